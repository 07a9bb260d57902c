//! Kinematics of the pose unknowns: unit twists of every degree of freedom (eq. 31) and the update.

use super::Dof;
use nalgebra::{DVector, Vector3};
use tryon_body::{BoneTransforms, JointMotion, Pose, Skeleton};
use tryon_geometry::math::{Rigid, Twist, exp_se3, exp_so3, log_so3};

/// Fills `out` with the unit twists (eq. 31) about `centre`, the origin of their frame. An angle of a ball turns about an
/// axis of its parent bone, so that the update is a rotation on the left.
pub fn linearise<F>(
    skeleton: &Skeleton,
    bones: &BoneTransforms,
    pose: &Pose<F>,
    centre: &Vector3<f64>,
    out: &mut Vec<Dof>,
) {
    out.clear();
    let axis = |k: usize| Vector3::from_fn(|r, _| if r == k { 1.0 } else { 0.0 });
    for k in 0..3 {
        out.push(Dof {
            bone: 0,
            twist: Twist {
                linear: axis(k),
                angular: Vector3::zeros(),
            },
        });
    }
    for k in 0..3 {
        out.push(Dof {
            bone: 0,
            twist: Twist {
                linear: Vector3::zeros(),
                angular: axis(k),
            },
        });
    }
    for (j, joint) in skeleton.joints().iter().enumerate() {
        let rotation = joint
            .parent
            .map_or(pose.root.iso().rotation, |p| bones.bones[p].rotation);
        let pivot = bones.joints[j].coords - centre;
        let mut push = |a: Vector3<f64>| {
            out.push(Dof {
                bone: j,
                twist: Twist::revolute(rotation * a, pivot),
            })
        };
        match &joint.motion {
            JointMotion::Fixed => {}
            JointMotion::Hinge { axis, .. } => push(Vector3::from(*axis)),
            JointMotion::Ball { .. } => (0..3).for_each(|k| push(axis(k))),
        }
    }
}

/// Moves `pose` by the solution `x` of the normal equations, shape `[unknowns]`.
pub fn apply<F>(skeleton: &Skeleton, pose: &mut Pose<F>, centre: &Vector3<f64>, x: &DVector<f64>) {
    let xi = Twist {
        linear: Vector3::new(x[0], x[1], x[2]),
        angular: Vector3::new(x[3], x[4], x[5]),
    };
    let shift = nalgebra::Translation3::from(*centre);
    let mut root = shift * exp_se3(&xi) * shift.inverse() * pose.root.iso();
    root.rotation.renormalize();
    pose.root = Rigid::new(root);
    for (j, joint) in skeleton.joints().iter().enumerate() {
        let at = skeleton.dof_offset(j);
        match &joint.motion {
            JointMotion::Fixed => {}
            JointMotion::Hinge { .. } => pose.angles[at] += x[6 + at],
            JointMotion::Ball { .. } => {
                let old = pose.rotation_vector(skeleton, j);
                let step = Vector3::new(x[6 + at], x[7 + at], x[8 + at]);
                let new = log_so3(&(exp_so3(&step) * exp_so3(&old)));
                pose.angles[at..at + 3].copy_from_slice(new.as_slice());
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use nalgebra::{Point3, UnitQuaternion};
    use tryon_body::{Joint, RestBody};

    /// A trunk with one arm, posed.
    pub(crate) fn arm() -> (Skeleton, RestBody, Pose) {
        let ball = JointMotion::Ball {
            limits: [[-3.0, 3.0]; 3],
        };
        let hinge = JointMotion::Hinge {
            axis: [0.0, 0.6, 0.8],
            limits: [-3.0, 3.0],
        };
        let joint = |name: &str, parent, x: f64, motion| Joint {
            name: name.into(),
            parent,
            rest: Point3::new(x, 0.1 * x, 0.0),
            motion,
        };
        let skeleton = Skeleton::new(vec![
            joint("pelvis", None, 0.0, JointMotion::Fixed),
            joint("shoulder", Some(0), 0.2, ball),
            joint("elbow", Some(1), 0.5, hinge),
            joint("end", Some(2), 0.8, JointMotion::Fixed),
        ])
        .expect("valid");
        let joints = skeleton.joints().iter().map(|j| j.rest).collect();
        let mut pose = Pose::rest(
            &skeleton,
            Rigid::from_parts(
                Vector3::new(0.1, -0.2, 2.0),
                UnitQuaternion::from_euler_angles(0.3, 2.8, 0.1),
            ),
        );
        pose.angles = vec![0.4, -0.7, 0.9, 0.5];
        (
            skeleton,
            RestBody {
                joints,
                ..Default::default()
            },
            pose,
        )
    }

    #[test]
    fn twists_are_the_derivative_of_the_update() {
        let (skeleton, rest, pose) = arm();
        let mut bones = BoneTransforms::default();
        pose.bones(&skeleton, &rest, &mut bones);
        let centre = bones.joints[0].coords;
        let mut dofs = Vec::new();
        linearise(&skeleton, &bones, &pose, &centre, &mut dofs);
        assert_eq!(dofs.len(), 6 + skeleton.dofs());
        let v = Point3::new(0.9, 0.05, 0.1);
        let posed = |p: &Pose| {
            let mut b = BoneTransforms::default();
            p.bones(&skeleton, &rest, &mut b);
            b.bones[2] * v
        };
        let here = posed(&pose);
        for (k, dof) in dofs.iter().enumerate() {
            let h = 1e-6;
            let mut moved = pose.clone();
            let mut x = DVector::zeros(dofs.len());
            x[k] = h;
            apply(&skeleton, &mut moved, &centre, &x);
            let fd = (posed(&moved) - here) / h;
            let ours = dof.twist.velocity_at(&(here.coords - centre));
            assert!(
                (fd - ours).norm() < 1e-5,
                "unknown {k}: {fd} against {ours}"
            );
        }
    }
}
