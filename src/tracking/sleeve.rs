//! An arm whose sleeve gives no return, but whose hand does: the hand tells where the arm goes.

use super::align::{AlignScratch, Seen};
use super::limb::Limb;
use super::model::TrackerModel;
use crate::body::{BoneTransforms, Pose, RestBody};
use crate::math::{P3, P3d};
use crate::spatial::Label;
use nalgebra::Vector3;

/// Weight of a hand's place, per point: against arms without a reading (2·10⁻⁶ per squared radian) it decides, against
/// seen ones (10⁻³) it has hardly a say.
const HAND: f64 = 1e-3;
/// A hand this near to where the pose has it is followed, one farther away is reached for anew, metres.
const FOLLOWED: f64 = 0.15;
/// A forearm is seen when so many of the points along it have a reading of the person this near in depth, metres.
const SEEN_POINTS: usize = 3;
/// See [`SEEN_POINTS`].
const NEAR: f64 = 0.10;
/// See [`SEEN_POINTS`].
const ALONG: usize = 5;
/// A hand farther from the shoulder than the arm is long times this belongs to somebody else.
const STRETCH: f64 = 1.15;

impl Limb {
    /// The camera has readings of the person along the forearm.
    fn seen(&self, bones: &BoneTransforms, seen: &Seen<'_>) -> bool {
        let (from, to) = (bones.joints[self.hinge], self.hand(bones));
        let on = |k: &usize| {
            let p = from + (to - from) * (*k as f64 / (ALONG - 1) as f64);
            let cell = seen
                .grid
                .cell_of(&p.cast())
                .and_then(|(u, v)| seen.grid.cell(u, v));
            cell.is_some_and(|c| {
                seen.grid.labels[c] == Label::Person
                    && (f64::from(seen.grid.depth[c]) - p.z).abs() < NEAR
            })
        };
        (0..ALONG).filter(on).count() >= SEEN_POINTS
    }
}

/// Which of the lone hands belongs to which arm of `pose`, left and right. An arm that is far from its hand is put there.
pub(super) fn assign(
    model: &TrackerModel,
    rest: &RestBody,
    pose: &mut Pose,
    seen: &Seen<'_>,
    hands: &[P3],
) -> [Option<Vector3<f64>>; 2] {
    let mut out = [None; 2];
    if hands.is_empty() {
        return out;
    }
    let mut bones = BoneTransforms::default();
    pose.bones(model.template.skeleton(), rest, &mut bones);
    for (found, arm) in out.iter_mut().zip(&model.arms) {
        let Some(arm) = arm.as_ref().filter(|a| !a.seen(&bones, seen)) else {
            continue;
        };
        let shoulder = bones.joints[arm.root];
        let length = arm.length(rest);
        // The other shoulder's hand is not this one's, unless this one's is nearer.
        let across = model.arms.iter().flatten().find(|a| a.root != arm.root);
        let mine = |h: &P3d| {
            let off = (h - shoulder).norm();
            let other = across.map_or(f64::INFINITY, |a| (h - bones.joints[a.root]).norm());
            off < STRETCH * length && off < other
        };
        let near = |h: &P3d| (h - arm.hand(&bones)).norm();
        let hand = hands
            .iter()
            .map(|h| h.cast::<f64>())
            .filter(mine)
            .min_by(|a, b| near(a).total_cmp(&near(b)));
        if let Some(hand) = hand {
            if near(&hand) > FOLLOWED {
                arm.reach(model, rest, pose, &hand, None);
            }
            *found = Some(hand.coords);
        }
    }
    out
}

/// Adds lone hands to the normal equations of `scratch`.
pub(super) fn hold(model: &TrackerModel, scratch: &mut AlignScratch) {
    let centre = scratch.bones.joints[0].coords;
    let hands = scratch.terms.hands;
    for (arm, hand) in model.arms.iter().zip(hands) {
        let (Some(arm), Some(hand)) = (arm, hand) else {
            continue;
        };
        let p = arm.hand(&scratch.bones).coords;
        for k in 0..3 {
            let slope = |&a: &usize| scratch.dofs[6 + a].twist.velocity_at(&(p - centre))[k];
            let slopes: Vec<f64> = arm.angles.iter().map(slope).collect();
            scratch.add_row(&arm.angles, &slopes, hand[k] - p[k], HAND);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Calibration, Intrinsics};
    use crate::segment::Contour;
    use crate::spatial::OrganisedCloud;
    use crate::tracking::{TrackerConfig, TrackerState};

    #[test]
    fn an_arm_reaches_for_a_lone_hand_and_leaves_those_of_others() {
        let config = TrackerConfig {
            samples: 50,
            ..TrackerConfig::default()
        };
        let calibration = Calibration::registered(Intrinsics::KINECT_V1);
        let model = TrackerModel::new(crate::body::embedded::template(), calibration, config);
        let rest = model.template.personalise(&Default::default());
        let pose = TrackerState::new(&model).pose;
        let grid = OrganisedCloud::new(&model.calibration.depth, None);
        let contour = Contour::default();
        let seen = Seen {
            grid: &grid,
            cells: &[],
            contour: &contour,
            tree: None,
        };
        let mut bones = BoneTransforms::default();
        pose.bones(model.template.skeleton(), &rest, &mut bones);
        for side in 0..2 {
            let arm = model.arms[side].as_ref().expect("an arm");
            let shoulder = bones.joints[arm.root];
            let outward = (shoulder - bones.joints[0]).x.signum();
            for offset in [[0.3, 0.3, -0.1], [0.2, -0.2, -0.35], [0.45, 0.0, 0.0]] {
                let hand = shoulder + Vector3::new(outward * offset[0], offset[1], offset[2]);
                let mut found = pose.clone();
                let hands = assign(&model, &rest, &mut found, &seen, &[hand.cast()]);
                assert!(
                    hands[side].is_some() && hands[1 - side].is_none(),
                    "side {side}: {hands:?}"
                );
                let mut now = BoneTransforms::default();
                found.bones(model.template.skeleton(), &rest, &mut now);
                let off = (arm.hand(&now) - hand).norm();
                assert!(off < 0.08, "side {side}, {offset:?}: {off} m");
            }
            let far = shoulder + Vector3::new(outward * 1.2, 0.0, 0.0);
            let mut same = pose.clone();
            assert_eq!(
                assign(&model, &rest, &mut same, &seen, &[far.cast()]),
                [None; 2]
            );
            assert_eq!(same, pose);
        }
    }
}
