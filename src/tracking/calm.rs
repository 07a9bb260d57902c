//! The last pose and what this frame says, each by its uncertainty: a person who stands still does not tremble with the
//! sensor's noise.

use super::align::limit;
use super::model::TrackerModel;
use crate::body::parts::BodyPart;
use crate::body::{BoneTransforms, JointMotion, Pose, RestBody};
use crate::math::{Rigid, exp_so3, log_so3};
use nalgebra::Vector3;

/// Parts of the body that move by themselves: trunk with head, arms, legs.
pub(super) const PARTS: usize = BodyPart::ALL.len();

/// Share of the newest way in its running mean, four frames' worth: noise averages out of it, motion does not.
const MEMORY: f64 = 0.25;
/// What is left of a frame's uncertainty in the running mean. 0.15 / 0.25: a person who stands still moves by 0.63 / 0.49 mm
/// from picture to picture (1.06 without any of this, truly 0.11), a slowly moving one is 3.36 / 3.66 mm off (3.26), both at
/// an uncertainty of one residual.
const MEAN_UNCERTAINTY: f64 = 0.25;

/// Moves each part from `last` towards `fitted` by the gain v²/(v² + r²) of a Kalman filter, where v is the part's way
/// (root mean square over its joints, metres) and r its `uncertainty`: half of it at v = r. A way that the running mean
/// in `drift` (one vector a joint, camera frame, metres; empty at a start) shows to be no noise has a smaller r, so a part
/// that moves is followed within a frame or two.
pub(super) fn calm(
    model: &TrackerModel,
    rest: &RestBody,
    last: &Pose,
    fitted: &Pose,
    uncertainty: f64,
    drift: &mut Vec<Vector3<f64>>,
) -> Pose {
    let skeleton = model.template.skeleton();
    let (mut a, mut b) = (BoneTransforms::default(), BoneTransforms::default());
    last.bones(skeleton, rest, &mut a);
    fitted.bones(skeleton, rest, &mut b);
    drift.resize(model.parts.len(), Vector3::zeros());
    let mut way = [[0.0f64; 3]; PARTS];
    for (j, &part) in model.parts.iter().enumerate() {
        let off = b.joints[j] - a.joints[j];
        let kept = drift[j] + (off - drift[j]) * MEMORY;
        drift[j] = kept;
        let [sum, mean, n] = &mut way[part];
        *sum += off.norm_squared();
        *mean += kept.norm_squared();
        *n += 1.0;
    }
    let share = way.map(|[sum, mean, n]| {
        let gain = |v2: f64, r: f64| v2 / (v2 + r * r).max(f64::MIN_POSITIVE);
        let n = n.max(1.0);
        gain(sum / n, uncertainty).max(gain(mean / n, MEAN_UNCERTAINTY * uncertainty))
    });
    let mut out = fitted.clone();
    let (from, to) = (last.root.iso(), fitted.root.iso());
    // About the pelvis: a turn about the origin of the rest frame would move the body.
    let place = a.joints[0].coords + (b.joints[0] - a.joints[0]) * share[0];
    let turn =
        exp_so3(&(log_so3(&(to.rotation * from.rotation.inverse())) * share[0])) * from.rotation;
    let own = rest.joints[0].coords;
    out.root = Rigid::from_parts(place - turn * own, turn);
    for (j, joint) in skeleton.joints().iter().enumerate() {
        let (at, s) = (skeleton.dof_offset(j), share[model.parts[j]]);
        match &joint.motion {
            JointMotion::Fixed => {}
            JointMotion::Hinge { .. } => {
                out.angles[at] = last.angles[at] + (fitted.angles[at] - last.angles[at]) * s;
            }
            JointMotion::Ball { .. } => {
                let r = |p: &Pose| {
                    exp_so3(&Vector3::new(
                        p.angles[at],
                        p.angles[at + 1],
                        p.angles[at + 2],
                    ))
                };
                let turn = log_so3(&(r(fitted) * r(last).inverse())) * s;
                out.angles[at..at + 3]
                    .copy_from_slice(log_so3(&(exp_so3(&turn) * r(last))).as_slice());
            }
        }
    }
    limit(model, &mut out);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Calibration, Intrinsics};
    use crate::tracking::{TrackerConfig, TrackerState};
    use nalgebra::Translation3;
    use rand::{Rng, SeedableRng};

    const UNCERTAINTY: f64 = 2e-3;

    struct Scene {
        model: TrackerModel,
        rest: RestBody,
        pose: Pose,
        drift: Vec<Vector3<f64>>,
    }

    fn scene() -> Scene {
        let config = TrackerConfig {
            samples: 50,
            ..TrackerConfig::default()
        };
        let calibration = Calibration::registered(Intrinsics::KINECT_V1);
        let model = TrackerModel::new(crate::body::embedded::template(), calibration, config);
        let rest = model.template.personalise(&Default::default());
        let pose = TrackerState::new(&model).pose;
        Scene {
            model,
            rest,
            pose,
            drift: Vec::new(),
        }
    }

    impl Scene {
        fn joints(&self, pose: &Pose) -> Vec<crate::math::P3d> {
            let mut bones = BoneTransforms::default();
            pose.bones(self.model.template.skeleton(), &self.rest, &mut bones);
            bones.joints
        }
        /// Root mean square distance of all joints, metres.
        fn off(&self, a: &Pose, b: &Pose) -> f64 {
            let (a, b) = (self.joints(a), self.joints(b));
            (a.iter()
                .zip(&b)
                .map(|(a, b)| (a - b).norm_squared())
                .sum::<f64>()
                / a.len() as f64)
                .sqrt()
        }
        fn see(&mut self, fitted: &Pose) -> Pose {
            let last = self.pose.clone();
            self.pose = calm(
                &self.model,
                &self.rest,
                &last,
                fitted,
                UNCERTAINTY,
                &mut self.drift,
            );
            last
        }
    }

    fn moved(pose: &Pose, by: Vector3<f64>) -> Pose {
        Pose {
            root: Rigid::new(Translation3::from(by) * pose.root.iso()),
            ..pose.clone()
        }
    }

    #[test]
    fn noise_is_quieted_and_motion_followed() {
        let mut s = scene();
        let truth = s.pose.clone();
        let mut rng = rand_pcg::Pcg32::seed_from_u64(3);
        let (mut raw, mut kept, mut last_seen) = (0.0, 0.0, truth.clone());
        for i in 0..80 {
            let mut seen = truth.clone();
            for a in &mut seen.angles {
                *a += rng.random_range(-1.5e-3..1.5e-3);
            }
            seen.clamp_to_limits(s.model.template.skeleton());
            let last = s.see(&seen);
            if i >= 20 {
                raw += s.off(&seen, &last_seen);
                kept += s.off(&s.pose, &last);
            }
            last_seen = seen;
        }
        assert!(kept < 0.35 * raw, "from picture to picture {kept} of {raw}");
        // Walking on at 3 cm/s, 30 cm/s, and a jump.
        for (speed, allowed) in [(1e-3, 3.5e-3), (1e-2, 1e-3)] {
            for _ in 0..20 {
                let next = moved(&last_seen, Vector3::x() * speed);
                s.see(&next);
                last_seen = next;
            }
            let lag = s.off(&s.pose, &last_seen);
            assert!(lag < allowed, "at {speed} m a frame: {lag} m behind");
        }
        let far = moved(&last_seen, Vector3::new(0.2, 0.0, 0.1));
        s.see(&far);
        assert!(s.off(&s.pose, &far) < 1e-4, "a jump is a jump");
    }

    #[test]
    fn a_moving_arm_does_not_wake_the_trunk_and_nothing_stays_nothing() {
        let mut s = scene();
        let truth = s.pose.clone();
        let mut seen = moved(&truth, Vector3::x() * 3e-4);
        let arm = s.model.arms[0].as_ref().expect("an arm").angles.clone();
        seen.angles[arm[2]] -= 0.3;
        s.see(&seen);
        assert!(
            (s.pose.angles[arm[2]] - seen.angles[arm[2]]).abs() < 2e-3,
            "the arm follows"
        );
        let shift =
            (s.pose.root.iso().translation.vector - truth.root.iso().translation.vector).norm();
        assert!(shift < 0.3 * 3e-4, "the trunk stays: {shift}");
        let mut still = scene();
        let same = still.pose.clone();
        still.see(&same);
        assert!(still.off(&still.pose, &same) < 1e-12);
        let quiet = calm(
            &still.model,
            &still.rest,
            &same,
            &seen,
            0.0,
            &mut still.drift.clone(),
        );
        assert!(
            still.off(&quiet, &seen) < 1e-9,
            "without uncertainty the frame decides"
        );
    }
}
