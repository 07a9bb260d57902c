//! Pose filter: fuses the last pose with the frame's fit by their uncertainties, per body part, like a Kalman filter of
//! constant position. A subject at rest shows no sensor noise; a moving part is followed within two frames.

use super::extrapolation::advance_angles;
use super::solve::limit;
use crate::model::TrackerModel;
use nalgebra::Vector3;
use tryon_body::parts::BodyPart;
use tryon_body::{BoneTransforms, Pose, RestBody};
use tryon_geometry::math::{Rigid, exp_so3, log_so3};

/// Parts of the body that are filtered separately.
const PARTS: usize = BodyPart::ALL.len();
/// Weight of the newest displacement in its running mean: four frames' memory. Noise averages out of it, motion does not.
const MEMORY: f64 = 0.25;
/// Uncertainty of the running mean relative to that of one frame. Smaller follows slow motion closer and trembles more
/// (0.15 / 0.25: 3.36 / 3.66 mm behind, 0.63 / 0.49 mm from frame to frame).
const MEAN_UNCERTAINTY: f64 = 0.25;

/// Moves each part from `last` towards `fitted` by the gain v²/(v² + r²).
///
/// v is the part's displacement (root mean square over its joints, metres), r the `uncertainty`, metres. `drift` is the
/// running mean of the displacements (one vector a joint, camera frame, metres; empty at a start). Its gain, at a smaller
/// uncertainty, counts where it is larger.
pub(crate) fn filter_pose(
    model: &TrackerModel,
    rest: &RestBody,
    (last, fitted): (&Pose, &Pose),
    uncertainty: f64,
    drift: &mut Vec<Vector3<f64>>,
) -> Pose {
    let skeleton = model.template.skeleton();
    let (mut a, mut b) = (BoneTransforms::default(), BoneTransforms::default());
    last.bones(skeleton, rest, &mut a);
    fitted.bones(skeleton, rest, &mut b);
    let gains = part_gains(model, (&a, &b), uncertainty, drift);
    let mut out = last.clone();
    let (from, to) = (last.root.iso(), fitted.root.iso());
    // About the pelvis: a turn about the origin of the rest frame would move the body.
    let pelvis = a.joints[0].coords + (b.joints[0] - a.joints[0]) * gains[0];
    let turn = exp_so3(&(log_so3(&(to.rotation * from.rotation.inverse())) * gains[0]));
    let rotation = turn * from.rotation;
    out.root = Rigid::from_parts(pelvis - rotation * rest.joints[0].coords, rotation);
    advance_angles(skeleton, &mut out, (last, fitted), |j| {
        gains[model.parts[j]]
    });
    limit(model, &mut out);
    out
}

/// Gain of each part, 0 to 1; updates the running means.
fn part_gains(
    model: &TrackerModel,
    (last, fitted): (&BoneTransforms, &BoneTransforms),
    uncertainty: f64,
    drift: &mut Vec<Vector3<f64>>,
) -> [f64; PARTS] {
    drift.resize(model.parts.len(), Vector3::zeros());
    let mut sums = [[0.0f64; 3]; PARTS];
    for (j, &part) in model.parts.iter().enumerate() {
        let off = fitted.joints[j] - last.joints[j];
        let mean = drift[j] + (off - drift[j]) * MEMORY;
        drift[j] = mean;
        let [now, kept, n] = &mut sums[part];
        *now += off.norm_squared();
        *kept += mean.norm_squared();
        *n += 1.0;
    }
    sums.map(|[now, kept, n]| {
        let gain = |v2: f64, r: f64| v2 / (v2 + r * r).max(f64::MIN_POSITIVE);
        let n = n.max(1.0);
        gain(now / n, uncertainty).max(gain(kept / n, MEAN_UNCERTAINTY * uncertainty))
    })
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
            let (model, rest) = (&self.scene.model, &self.scene.rest);
            let poses = (&self.pose, fitted);
            let next = filter_pose(model, rest, poses, uncertainty, &mut self.drift);
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
