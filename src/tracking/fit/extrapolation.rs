//! Extrapolation of a motion, and its size.

use tryon_body::{JointMotion, Pose, Skeleton};
use tryon_geometry::math::{Rigid, exp_so3, log_so3};

/// Extrapolates the motion from `before` to `last` by `ratio` of its duration.
pub(crate) fn extrapolate(skeleton: &Skeleton, before: &Pose, last: &Pose, ratio: f64) -> Pose {
    let (a, b) = (before.root.iso(), last.root.iso());
    let turn = log_so3(&(b.rotation * a.rotation.inverse())) * ratio;
    let rotation = exp_so3(&turn) * b.rotation;
    let translation = b.translation.vector + (b.translation.vector - a.translation.vector) * ratio;
    let mut next = last.clone();
    next.root = Rigid::from_parts(translation, rotation);
    advance_angles(skeleton, &mut next, before, last, |_| ratio);
    next
}

/// Moves the joint angles of `pose` by a share of the way between two poses; `share` is a function of the joint.
pub(crate) fn advance_angles(
    skeleton: &Skeleton,
    pose: &mut Pose,
    from: &Pose,
    to: &Pose,
    share: impl Fn(usize) -> f64,
) {
    for (j, joint) in skeleton.joints().iter().enumerate() {
        let at = skeleton.dof_offset(j);
        match &joint.motion {
            JointMotion::Fixed => {}
            JointMotion::Hinge { .. } => {
                pose.angles[at] += (to.angles[at] - from.angles[at]) * share(j);
            }
            JointMotion::Ball { .. } => {
                let rotation = |p: &Pose| exp_so3(&p.rotation_vector(skeleton, j));
                let turn = log_so3(&(rotation(to) * rotation(from).inverse())) * share(j);
                let new = log_so3(&(exp_so3(&turn) * rotation(pose)));
                pose.angles[at..at + 3].copy_from_slice(new.as_slice());
            }
        }
    }
}

/// Lever that makes turns comparable with displacements, metres: distance of skin from its joint.
pub(crate) const LEVER: f64 = 0.25;

/// Largest motion between two poses, metres: of the root, or of a joint's angle with a lever of [`LEVER`].
pub(crate) fn motion(skeleton: &Skeleton, from: &Pose, to: &Pose) -> f64 {
    let root = skeleton.joints()[0].rest;
    let shift = (to.root.point(&root) - from.root.point(&root)).norm();
    let turn = (from.root.iso().rotation.inverse() * to.root.iso().rotation).angle();
    let angles = from
        .angles
        .iter()
        .zip(&to.angles)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    shift.max(LEVER * turn.max(angles))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::apply;
    use crate::registration::arm;
    use nalgebra::{DVector, Vector3};

    #[test]
    fn extrapolation_continues_a_steady_motion() {
        let (skeleton, _, pose) = arm();
        let x = DVector::from_fn(10, |i, _| 0.01 * (i as f64 - 4.0));
        let c = Vector3::zeros();
        let (mut one, mut two) = (pose.clone(), pose.clone());
        apply(&skeleton, &mut one, &c, &x);
        apply(&skeleton, &mut two, &c, &(&x * 2.0));
        let guess = extrapolate(&skeleton, &pose, &one, 1.0);
        let off = |a: &Pose, b: &Pose| {
            a.angles
                .iter()
                .zip(&b.angles)
                .map(|(p, q)| (p - q).abs())
                .fold(0.0, f64::max)
        };
        assert!(off(&guess, &two) < 0.2 * off(&one, &two));
        // A rotation vector goes through a quaternion and back: equal to rounding, not to the bit.
        assert!(off(&extrapolate(&skeleton, &pose, &one, 0.0), &one) < 1e-12);
    }
}
