//! Somebody who sits, told from somebody who crouches or kneels: without a seat, the body would fall backwards.

use super::confidence::JointConfidence;
use crate::model::TrackerModel;
use crate::settings::SeatSettings;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::P3d;

/// Share of the body's mass in the trunk with head and arms; the rest is at the knees (Winter 2009, table 4.1: legs 32 %).
const TRUNK_MASS: f64 = 0.68;

/// Posture of the subject over time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Seat {
    /// The subject sits.
    pub(crate) is_taken: bool,
    /// Frames in a row that say otherwise.
    against: u32,
    /// A frame has shown the posture.
    #[serde(default)]
    is_known: bool,
}

impl Seat {
    /// Adds a frame; `None` where the legs aren't in view.
    pub(crate) fn update(&mut self, sits: Option<bool>, settings: &SeatSettings) {
        let is_against = sits.is_some_and(|sits| sits != self.is_taken);
        self.against = if is_against { self.against + 1 } else { 0 };
        if self.against >= settings.steady || is_against && !self.is_known {
            (self.is_taken, self.against) = (!self.is_taken, 0);
        }
        self.is_known |= sits.is_some();
    }
}

/// True for posed joints (camera frame, metres; `up` against gravity) of somebody who sits; `None` without legs in view.
pub(crate) fn sits(
    model: &TrackerModel,
    up: &Vector3<f64>,
    joints: &[P3d],
    confidence: &[JointConfidence],
) -> Option<bool> {
    let settings = &model.config.assess.seat;
    let is_seen = |knee: usize| confidence.get(knee).is_some_and(|c| c.value > 0.0);
    let mut knees = model.standing.iter().filter_map(|leg| leg.knee);
    if !knees.any(is_seen) {
        return None;
    }
    let mut legs = model.standing.iter().filter_map(|leg| {
        let ankle = leg.foot.soles.first()?.0;
        Some([joints[leg.hip], joints[leg.knee?], joints[ankle]].map(|p| p.coords))
    });
    let (left, right) = (legs.next()?, legs.next()?);
    let [hip, knee, ankle] = std::array::from_fn(|k| (left[k] + right[k]) * 0.5);
    let is_raised = |[hip, knee, _]: &[Vector3<f64>; 3]| {
        let thigh = knee - hip;
        -thigh.dot(up) < settings.raised * thigh.norm()
    };
    let level = |v: Vector3<f64>| v - up * v.dot(up);
    let Some(front) = level(knee - hip).try_normalize(0.0) else {
        return Some(false);
    };
    let centre = joints[model.chest].coords * TRUNK_MASS + knee * (1.0 - TRUNK_MASS);
    let behind = (ankle - centre).dot(&front) - settings.heel;
    Some(is_raised(&left) && is_raised(&right) && behind > settings.behind)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assess::confidence::ConfidenceReason;
    use crate::test_scene::TestScene;
    use tryon_body::BoneTransforms;

    /// Verdict on a body with thighs raised forward by `hips`, knees bent by `knees` and the trunk leaning forward by `lean`,
    /// radians; all joints in view.
    fn verdict(scene: &TestScene, [hips, knees, lean]: [f64; 3]) -> Option<bool> {
        let skeleton = scene.model.template.skeleton();
        let mut pose = scene.pose.clone();
        for side in ["left", "right"] {
            pose.set(skeleton, &format!("{side}_hip"), &[-hips, 0.0, 0.0]);
            pose.set(skeleton, &format!("{side}_knee"), &[knees]);
        }
        pose.set(skeleton, "spine1", &[lean, 0.0, 0.0]);
        let rest = scene.model.template.personalise(&Default::default());
        let mut bones = BoneTransforms::default();
        pose.bones(skeleton, &rest, &mut bones);
        let seen = JointConfidence {
            value: 1.0,
            reason: ConfidenceReason::Measured,
        };
        let (up, joints) = (-Vector3::y(), bones.joints);
        assert_eq!(
            sits(&scene.model, &up, &joints, &[]),
            None,
            "nothing in view"
        );
        sits(&scene.model, &up, &joints, &vec![seen; joints.len()])
    }

    #[test]
    fn only_who_sits_is_behind_the_own_feet() {
        let scene = TestScene::new(300, 240);
        let cases = [
            ("standing", [0.0, 0.0, 0.0], false),
            ("seated", [1.5, 1.5, 0.0], true),
            ("seated, leaning forward", [1.5, 1.5, 0.3], true),
            ("squatting", [1.9, 2.3, 0.8], false),
            ("on both knees", [0.1, 1.6, 0.0], false),
        ];
        for (name, angles, expected) in cases {
            assert_eq!(verdict(&scene, angles), Some(expected), "{name}");
        }
    }

    #[test]
    fn the_first_posture_counts_at_once_and_another_after_some_frames_in_a_row() {
        let settings = SeatSettings::default();
        let mut seated = Seat::default();
        seated.update(None, &settings);
        assert!(!seated.is_taken);
        seated.update(Some(true), &settings);
        assert!(seated.is_taken);

        let mut seat = Seat::default();
        seat.update(Some(false), &settings);
        let feed = |seat: &mut Seat, n: u32, sits: Option<bool>| {
            (0..n).for_each(|_| seat.update(sits, &settings));
            seat.is_taken
        };
        assert!(!feed(&mut seat, settings.steady - 1, Some(true)));
        assert!(!feed(&mut seat, 1, Some(false)), "not in a row");
        assert!(feed(&mut seat, settings.steady, Some(true)));
        assert!(feed(&mut seat, 50, None), "legs out of view say nothing");
        assert!(!feed(&mut seat, settings.steady, Some(false)));
    }
}
