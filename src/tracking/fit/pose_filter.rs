//! Pose filter: fuses the last pose with the frame's fit by their uncertainties, per body part, like a Kalman filter of
//! constant position. A subject at rest shows no sensor noise; a moving part is followed within two frames.

use super::extrapolation::advance_angles;
use crate::model::TrackerModel;
use nalgebra::Vector3;
use tryon_body::parts::BodyPart;
use tryon_body::{BoneTransforms, Pose, RestBody};
use tryon_geometry::math::{Rigid, exp_so3, log_so3};

/// Parts of the body that are filtered separately.
const PARTS: usize = BodyPart::ALL.len();

/// One frame of the filter.
pub(crate) struct PoseFilter<'a> {
    pub model: &'a TrackerModel,
    pub rest: &'a RestBody,
    /// Pose expected from the last one.
    pub last: &'a Pose,
    /// Fit of the frame.
    pub fitted: &'a Pose,
    /// Uncertainty of the fit, metres.
    pub uncertainty: f64,
}

impl PoseFilter<'_> {
    /// Moves each part from the last pose towards the fit by the gain v²/(v² + r²).
    ///
    /// v is the part's displacement (root mean square over its joints, metres), r the uncertainty. `drift` is the running
    /// mean of the displacements (one vector a joint, camera frame, metres; empty at a start). Its gain, at a smaller
    /// uncertainty, counts where it is larger.
    pub(crate) fn filter(&self, drift: &mut Vec<Vector3<f64>>) -> Pose {
        let (model, skeleton) = (self.model, self.model.template.skeleton());
        let (mut a, mut b) = (BoneTransforms::default(), BoneTransforms::default());
        self.last.bones(skeleton, self.rest, &mut a);
        self.fitted.bones(skeleton, self.rest, &mut b);
        let gains = self.part_gains(&a, &b, drift);
        let mut out = self.last.clone();
        let (from, to) = (self.last.root.iso(), self.fitted.root.iso());
        // About the pelvis: a turn about the origin of the rest frame would move the body.
        let pelvis = a.joints[0].coords + (b.joints[0] - a.joints[0]) * gains[0];
        let turn = exp_so3(&(log_so3(&(to.rotation * from.rotation.inverse())) * gains[0]));
        let rotation = turn * from.rotation;
        out.root = Rigid::from_parts(pelvis - rotation * self.rest.joints[0].coords, rotation);
        advance_angles(skeleton, &mut out, self.last, self.fitted, |j| {
            gains[model.parts[j]]
        });
        out.clamp_to_limits(skeleton);
        out
    }

    /// Gain of each part, 0 to 1; updates the running means.
    fn part_gains(
        &self,
        last: &BoneTransforms,
        fitted: &BoneTransforms,
        drift: &mut Vec<Vector3<f64>>,
    ) -> [f64; PARTS] {
        let (parts, settings) = (&self.model.parts, &self.model.config.fit);
        drift.resize(parts.len(), Vector3::zeros());
        let mut sums = [[0.0f64; 3]; PARTS];
        for (j, &part) in parts.iter().enumerate() {
            let off = fitted.joints[j] - last.joints[j];
            let mean = drift[j] + (off - drift[j]) * settings.filter_memory;
            drift[j] = mean;
            let [now, kept, n] = &mut sums[part];
            *now += off.norm_squared();
            *kept += mean.norm_squared();
            *n += 1.0;
        }
        sums.map(|[now, kept, n]| {
            let gain = |v2: f64, r: f64| v2 / (v2 + r * r).max(f64::MIN_POSITIVE);
            let n = n.max(1.0);
            let mean = settings.mean_uncertainty * self.uncertainty;
            gain(now / n, self.uncertainty).max(gain(kept / n, mean))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::TestScene;
    use nalgebra::Translation3;
    use rand::{Rng, SeedableRng};

    const UNCERTAINTY: f64 = 2e-3;

    struct Filtered {
        scene: TestScene,
        pose: Pose,
        drift: Vec<Vector3<f64>>,
    }

    impl Filtered {
        fn new() -> Self {
            let scene = TestScene::default();
            Self {
                pose: scene.pose.clone(),
                drift: Vec::new(),
                scene,
            }
        }
        /// Root mean square distance of all joints, metres.
        fn distance(&self, a: &Pose, b: &Pose) -> f64 {
            let (a, b) = (self.scene.joints(a), self.scene.joints(b));
            let sum: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).norm_squared()).sum();
            (sum / a.len() as f64).sqrt()
        }
        /// Filters one frame; returns the pose before it.
        fn step(&mut self, fitted: &Pose, uncertainty: f64) -> Pose {
            let filter = PoseFilter {
                model: &self.scene.model,
                rest: &self.scene.rest,
                last: &self.pose,
                fitted,
                uncertainty,
            };
            let next = filter.filter(&mut self.drift);
            std::mem::replace(&mut self.pose, next)
        }
    }

    fn moved(pose: &Pose, by: Vector3<f64>) -> Pose {
        Pose {
            root: Rigid::new(Translation3::from(by) * pose.root.iso()),
            ..pose.clone()
        }
    }

    #[test]
    fn noise_is_attenuated_and_motion_followed() {
        let mut s = Filtered::new();
        let truth = s.pose.clone();
        let mut rng = rand_pcg::Pcg32::seed_from_u64(3);
        let (mut raw, mut kept, mut last_fitted) = (0.0, 0.0, truth.clone());
        for i in 0..80 {
            let mut fitted = truth.clone();
            for a in &mut fitted.angles {
                *a += rng.random_range(-1.5e-3..1.5e-3);
            }
            fitted.clamp_to_limits(s.scene.model.template.skeleton());
            let last = s.step(&fitted, UNCERTAINTY);
            if i >= 20 {
                raw += s.distance(&fitted, &last_fitted);
                kept += s.distance(&s.pose, &last);
            }
            last_fitted = fitted;
        }
        assert!(kept < 0.35 * raw, "from frame to frame {kept} of {raw}");
        for (speed, allowed) in [(1e-3, 3.5e-3), (1e-2, 1e-3)] {
            for _ in 0..20 {
                let next = moved(&last_fitted, Vector3::x() * speed);
                s.step(&next, UNCERTAINTY);
                last_fitted = next;
            }
            let lag = s.distance(&s.pose, &last_fitted);
            assert!(lag < allowed, "at {speed} m a frame: {lag} m behind");
        }
        let far = moved(&last_fitted, Vector3::new(0.2, 0.0, 0.1));
        s.step(&far, UNCERTAINTY);
        assert!(s.distance(&s.pose, &far) < 1e-4, "a jump is followed");
    }

    #[test]
    fn parts_are_filtered_independently() {
        let mut s = Filtered::new();
        let truth = s.pose.clone();
        let mut fitted = moved(&truth, Vector3::x() * 3e-4);
        let arm = s.scene.model.arms[0].as_ref().expect("an arm");
        let angle = arm.angles[2];
        fitted.angles[angle] -= 0.3;
        s.step(&fitted, UNCERTAINTY);
        let off = (s.pose.angles[angle] - fitted.angles[angle]).abs();
        assert!(off < 2e-3, "the arm follows");
        let at = |p: &Pose| p.root.iso().translation.vector;
        let shift = (at(&s.pose) - at(&truth)).norm();
        assert!(shift < 0.3 * 3e-4, "the trunk stays: {shift}");
    }

    #[test]
    fn equal_poses_stay_and_certain_fits_are_taken() {
        let mut s = Filtered::new();
        let same = s.pose.clone();
        s.step(&same, UNCERTAINTY);
        assert!(s.distance(&s.pose, &same) < 1e-12);
        let fitted = moved(&same, Vector3::x() * 3e-4);
        s.step(&fitted, 0.0);
        assert!(s.distance(&s.pose, &fitted) < 1e-9);
    }
}
