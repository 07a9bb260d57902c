//! The kinematic tree: joints with their degrees of freedom and limits.

use super::BodyError;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// Degrees of freedom of a joint relative to its parent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum JointMotion {
    /// None: end points of limbs, or joints that a template does not use.
    Fixed,
    /// One twist: rotation about `axis` (unit, rest frame) by an angle within `limits`, radians.
    Hinge {
        /// Unit rotation axis in the rest frame.
        axis: [f64; 3],
        /// Smallest and largest angle, radians.
        limits: [f64; 2],
    },
    /// Three: the rotation vector (axis × angle) in the rest frame, each component within its limits, radians.
    /// Free of gimbal lock inside a half turn.
    Ball {
        /// Smallest and largest value of each component of the rotation vector, radians.
        limits: [[f64; 2]; 3],
    },
}

impl JointMotion {
    /// Number of angles of this joint in a pose.
    pub fn dofs(&self) -> usize {
        match self {
            Self::Fixed => 0,
            Self::Hinge { .. } => 1,
            Self::Ball { .. } => 3,
        }
    }
}

/// One node of the kinematic tree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Name, SMPL style: `pelvis`, `left_hip`, …; left is the subject's own left (+x facing +z).
    pub name: String,
    /// Index of the parent, smaller than the joint's own; `None` for the root only.
    pub parent: Option<usize>,
    /// Position in the rest pose, metres, frame `Body`.
    pub rest: Point3<f64>,
    /// Degrees of freedom.
    pub motion: JointMotion,
}

/// A tree of joints, parents before children, joint 0 the root (its motion is the pose's rigid transform).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Skeleton {
    joints: Vec<Joint>,
    dof_offsets: Vec<usize>,
    dofs: usize,
    primary_child: Vec<Option<usize>>,
}

impl Skeleton {
    /// Checks the tree and lays out the degrees of freedom in joint order.
    ///
    /// # Errors
    /// Names the joint that breaks the order, repeats a name, has no finite position or an empty limit interval.
    pub fn new(joints: Vec<Joint>) -> Result<Self, BodyError> {
        let fault = |joint: &Joint, why: &str| BodyError::Joint {
            joint: joint.name.clone(),
            why: why.to_owned(),
        };
        for (i, j) in joints.iter().enumerate() {
            match j.parent {
                None if i != 0 => return Err(fault(j, "only joint 0 may be without parent")),
                Some(p) if p >= i => return Err(fault(j, "its parent must come before it")),
                Some(_) if i == 0 => return Err(fault(j, "joint 0 is the root and has no parent")),
                _ => {}
            }
            if joints[..i].iter().any(|o| o.name == j.name) {
                return Err(fault(j, "the name is used twice"));
            }
            if !j.rest.iter().all(|c| c.is_finite()) {
                return Err(fault(j, "its rest position is not finite"));
            }
            let bad = |l: &[f64; 2]| !(l[0].is_finite() && l[1].is_finite() && l[0] <= l[1]);
            match &j.motion {
                JointMotion::Fixed => {}
                JointMotion::Hinge { axis, limits } => {
                    let n = nalgebra::Vector3::from(*axis).norm();
                    if bad(limits) || !((n - 1.0).abs() < 1e-6) {
                        return Err(fault(
                            j,
                            "a hinge needs a unit axis and ordered, finite limits",
                        ));
                    }
                }
                JointMotion::Ball { limits } => {
                    if limits.iter().any(bad) {
                        return Err(fault(j, "limits must be ordered and finite"));
                    }
                }
            }
        }
        let mut dofs = 0;
        let dof_offsets = joints
            .iter()
            .map(|j| {
                let at = dofs;
                dofs += j.motion.dofs();
                at
            })
            .collect();
        // The bone of a joint leads to its primary child: the one most in line with the parent's bone,
        // or at the root the first child named `spine…`, else the first child.
        let primary_child = (0..joints.len())
            .map(|i| {
                let children: Vec<usize> = (i + 1..joints.len())
                    .filter(|&c| joints[c].parent == Some(i))
                    .collect();
                let along = joints[i].parent.map(|p| joints[i].rest - joints[p].rest);
                match along {
                    None => children
                        .iter()
                        .copied()
                        .find(|&c| joints[c].name.starts_with("spine"))
                        .or(children.first().copied()),
                    Some(d) => children.into_iter().max_by(|&a, &b| {
                        let cos = |c: usize| {
                            let e = joints[c].rest - joints[i].rest;
                            d.dot(&e) / (d.norm() * e.norm()).max(f64::MIN_POSITIVE)
                        };
                        cos(a).total_cmp(&cos(b))
                    }),
                }
            })
            .collect();
        Ok(Self {
            joints,
            dof_offsets,
            dofs,
            primary_child,
        })
    }
    /// All joints, parents first.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }
    /// Number of joints, end points included.
    pub fn len(&self) -> usize {
        self.joints.len()
    }
    /// Has no joints.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }
    /// Total number of joint angles (without the six of the root).
    pub fn dofs(&self) -> usize {
        self.dofs
    }
    /// Index of a joint's first angle in [`super::Pose::angles`].
    pub fn dof_offset(&self, joint: usize) -> usize {
        self.dof_offsets[joint]
    }
    /// The child at the far end of this joint's bone; `None` for end points.
    pub fn primary_child(&self, joint: usize) -> Option<usize> {
        self.primary_child[joint]
    }
    /// Index of the joint of that name.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|j| j.name == name)
    }
    /// Joint `a` is `j` or one of its ancestors (δ of eq. 2).
    pub fn is_ancestor(&self, a: usize, j: usize) -> bool {
        let mut at = Some(j);
        while let Some(k) = at {
            if k == a {
                return true;
            }
            at = self.joints[k].parent;
        }
        false
    }
    /// Smallest and largest value of each angle, shape `[dofs]`.
    pub fn limits(&self) -> Vec<[f64; 2]> {
        self.joints
            .iter()
            .flat_map(|j| match &j.motion {
                JointMotion::Fixed => vec![],
                JointMotion::Hinge { limits, .. } => vec![*limits],
                JointMotion::Ball { limits } => limits.to_vec(),
            })
            .collect()
    }
}
