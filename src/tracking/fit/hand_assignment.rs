//! Assignment of hands detected on their own to arms whose sleeve gives no return.

use crate::model::{Limb, TrackerModel};
use crate::settings::HandAssignmentSettings;
use tryon_body::{BoneTransforms, Pose, RestBody};
use tryon_geometry::math::{P3, P3d};
use tryon_geometry::spatial::{Label, OrganisedCloud};

/// True when the subject has readings along the forearm.
fn is_forearm_seen(
    arm: &Limb,
    bones: &BoneTransforms,
    grid: &OrganisedCloud,
    settings: &HandAssignmentSettings,
) -> bool {
    let (from, to) = (bones.joints[arm.hinge], arm.hand(bones));
    let on = |k: &usize| {
        let p = from + (to - from) * (*k as f64 / (settings.forearm_points - 1) as f64);
        let cell = grid.cell_of(&p.cast()).and_then(|(u, v)| grid.cell(u, v));
        cell.is_some_and(|c| {
            grid.labels[c] == Label::Person
                && (f64::from(grid.depth[c]) - p.z).abs() < settings.forearm_depth
        })
    };
    (0..settings.forearm_points).filter(on).count() >= settings.seen_points
}

/// Hand of each arm without readings, left and right, camera frame, metres. `pose` changes where an arm is far from its
/// hand: inverse kinematics moves it there.
pub(crate) fn assign_hands(
    model: &TrackerModel,
    rest: &RestBody,
    pose: &mut Pose,
    grid: &OrganisedCloud,
    hands: &[P3],
) -> [Option<P3d>; 2] {
    let settings = &model.config.fit.hands;
    let mut out = [None; 2];
    if hands.is_empty() {
        return out;
    }
    let skeleton = model.template.skeleton();
    let mut bones = BoneTransforms::default();
    pose.bones(skeleton, rest, &mut bones);
    for (found, arm) in out.iter_mut().zip(&model.arms) {
        let Some(arm) = arm
            .as_ref()
            .filter(|a| !is_forearm_seen(a, &bones, grid, settings))
        else {
            continue;
        };
        let shoulder = bones.joints[arm.root];
        let length = arm.length(rest);
        let across = model.arms.iter().flatten().find(|a| a.root != arm.root);
        let is_own = |h: &P3d| {
            let off = (h - shoulder).norm();
            let other = across.map_or(f64::INFINITY, |a| (h - bones.joints[a.root]).norm());
            off < settings.stretch * length && off < other
        };
        let distance = |h: &P3d| (h - arm.hand(&bones)).norm();
        let hand = hands
            .iter()
            .map(|h| h.cast::<f64>())
            .filter(is_own)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(hand) = hand {
            let mut reached = pose.clone();
            if distance(&hand) > settings.followed {
                arm.reach(skeleton, rest, &mut reached, &hand, None);
                reached.bones(skeleton, rest, &mut bones);
            }
            // A fragment of something else, with nothing but air on the way to it, is no hand.
            if arm.misplaced_points(&bones, grid, None) < settings.air_points {
                (*pose, *found) = (reached, Some(hand));
            }
            pose.bones(skeleton, rest, &mut bones);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::TestScene;
    use nalgebra::Vector3;

    #[test]
    fn an_arm_reaches_its_hand_and_leaves_those_of_others() {
        let scene = TestScene::default();
        let (model, pose) = (&scene.model, &scene.pose);
        let grid = OrganisedCloud::new(&model.calibration.depth, None);
        let assign = |pose: &mut Pose, hand: P3d| {
            assign_hands(model, &scene.rest, pose, &grid, &[hand.cast()])
        };
        let joints = scene.joints(pose);
        for side in 0..2 {
            let arm = model.arms[side].as_ref().expect("an arm");
            let shoulder = joints[arm.root];
            let outward = (shoulder - joints[0]).x.signum();
            for offset in [[0.3, 0.3, -0.1], [0.2, -0.2, -0.35], [0.45, 0.0, 0.0]] {
                let hand = shoulder + Vector3::new(outward * offset[0], offset[1], offset[2]);
                let mut found = pose.clone();
                let hands = assign(&mut found, hand);
                assert!(
                    hands[side].is_some() && hands[1 - side].is_none(),
                    "side {side}: {hands:?}"
                );
                let off = (arm.hand(&scene.bones(&found)) - hand).norm();
                assert!(off < 0.08, "side {side}, {offset:?}: {off} m");
            }
            let mut same = pose.clone();
            let far = shoulder + Vector3::new(outward * 1.2, 0.0, 0.0);
            assert_eq!(assign(&mut same, far), [None; 2]);
            assert_eq!(&same, pose);
        }
    }
}
