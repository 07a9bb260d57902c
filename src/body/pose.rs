//! Pose (root transform and joint angles) and forward kinematics.

use super::{JointMotion, RestBody, Skeleton};
use crate::math::{Body, Camera, Rigid, exp_so3};
use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use serde::{Deserialize, Serialize};

/// Pose of a body in frame `F` (the depth camera unless said otherwise).
#[derive(Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Pose<F = Camera> {
    /// Rest coordinates to `F`, before any joint moves.
    pub root: Rigid<F, Body>,
    /// Joint angles in the order of [`Skeleton::dof_offset`], radians: one for a hinge, a rotation vector for a ball.
    pub angles: Vec<f64>,
}

impl<F> Clone for Pose<F> {
    fn clone(&self) -> Self {
        Self {
            root: self.root,
            angles: self.angles.clone(),
        }
    }
}
impl<F> PartialEq for Pose<F> {
    fn eq(&self, o: &Self) -> bool {
        self.root == o.root && self.angles == o.angles
    }
}
impl<F> std::fmt::Debug for Pose<F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pose")
            .field("root", &self.root)
            .field("angles", &self.angles)
            .finish()
    }
}

/// Bone transforms of a posed body, rest coordinates to posed coordinates.
#[derive(Clone, Debug, Default)]
pub struct BoneTransforms {
    /// Skinning transforms, shape `[joints]`.
    pub bones: Vec<Isometry3<f64>>,
    /// Posed joint positions, shape `[joints]`.
    pub joints: Vec<Point3<f64>>,
}

impl<F> Pose<F> {
    /// The rest pose at `root`.
    pub fn rest(skeleton: &Skeleton, root: Rigid<F, Body>) -> Self {
        Self {
            root,
            angles: vec![0.0; skeleton.dofs()],
        }
    }
    /// Local rotation vector of a joint (axis × angle, rest frame).
    pub fn rotation_vector(&self, skeleton: &Skeleton, joint: usize) -> Vector3<f64> {
        let at = skeleton.dof_offset(joint);
        match &skeleton.joints()[joint].motion {
            JointMotion::Fixed => Vector3::zeros(),
            JointMotion::Hinge { axis, .. } => Vector3::from(*axis) * self.angles[at],
            JointMotion::Ball { .. } => {
                Vector3::new(self.angles[at], self.angles[at + 1], self.angles[at + 2])
            }
        }
    }
    /// Forward kinematics (eq. 2): transforms of all bones of the personalised rest body.
    pub fn bones(&self, skeleton: &Skeleton, rest: &RestBody, out: &mut BoneTransforms) {
        out.bones.clear();
        out.joints.clear();
        for (j, joint) in skeleton.joints().iter().enumerate() {
            let parent = joint.parent.map_or(*self.root.iso(), |p| out.bones[p]);
            let pivot = rest.joints[j];
            let rotation = exp_so3(&self.rotation_vector(skeleton, j));
            // T(p) R T(−p): rotates about the joint's rest position, so no inverse bind matrix is needed.
            let local = Isometry3::from_parts(
                Translation3::from(pivot.coords - rotation * pivot.coords),
                rotation,
            );
            out.bones.push(parent * local);
            out.joints.push(parent * pivot);
        }
    }
    /// Sets the angles of a joint by name; ignores names the skeleton lacks and extra values.
    pub fn set(&mut self, skeleton: &Skeleton, joint: &str, values: &[f64]) {
        if let Some(j) = skeleton.index(joint) {
            let at = skeleton.dof_offset(j);
            let n = skeleton.joints()[j].motion.dofs().min(values.len());
            self.angles[at..at + n].copy_from_slice(&values[..n]);
        }
    }
    /// Moves every angle into its limits.
    pub fn clamp_to_limits(&mut self, skeleton: &Skeleton) {
        for (a, l) in self.angles.iter_mut().zip(skeleton.limits()) {
            *a = a.clamp(l[0], l[1]);
        }
    }
    /// Has finite numbers only.
    pub fn is_finite(&self) -> bool {
        self.root.is_finite() && self.angles.iter().all(|a| a.is_finite())
    }
}
