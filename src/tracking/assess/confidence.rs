//! Confidence of each joint and its limiting reason, from the last pairing and normal equations.

use super::agreement::Agreement;
use crate::fit::{FitContext, FitScratch};
use serde::{Deserialize, Serialize};
use tryon_body::{JointMotion, Pose};
use tryon_geometry::spatial::Label;

/// Reason that limits a joint's confidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ConfidenceReason {
    /// Readings of its own bone.
    Measured,
    /// An angle is at the end of its range.
    AtLimit,
    /// Its bone has readings, but some turn does not change them (a twist, a limb along the view).
    Ambiguous,
    /// Its bone projects to cells without readings (black trousers, shiny surfaces).
    NoReturn,
    /// Much of its limb lies in measured free space: it is somewhere else.
    InFreeSpace,
    /// Its bone is occluded or outside the image.
    Unseen,
}

/// Confidence of one joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointConfidence {
    /// 0 (a guess) to 1 (well measured).
    pub value: f32,
    /// Limiting reason.
    pub reason: ConfidenceReason,
}

/// Confidence of every joint of the skeleton, in a pose that agrees with its frame so far.
pub(crate) fn confidence(
    context: &FitContext<'_>,
    pose: &Pose,
    scratch: &FitScratch,
    agreement: &Agreement,
) -> Vec<JointConfidence> {
    let settings = &context.model.config.assess.confidence;
    let model = context.model;
    let skeleton = model.template.skeleton();
    let readings = paired_samples(context, scratch);
    let missing = samples_without_return(context, scratch);
    let limits = skeleton.limits();
    let of_joint = |j: usize| {
        let motion = &skeleton.joints()[j].motion;
        // An end point or a joint without skin takes the confidence of its parent bone.
        let is_end = matches!(motion, JointMotion::Fixed) && readings[j] == 0;
        let bone = if is_end {
            model.parents[j].unwrap_or(j)
        } else {
            j
        };
        let at = skeleton.dof_offset(j);
        let angles = at..at + motion.dofs();
        let least = angles
            .clone()
            .map(|k| scratch.information(k))
            .fold(f64::INFINITY, f64::min);
        let at_limit = angles.clone().any(|k| {
            pose.angles[k] - limits[k][0] < settings.at_limit
                || limits[k][1] - pose.angles[k] < settings.at_limit
        });
        let share = readings[bone] as f32 / (readings[bone] as f32 + settings.half_sure);
        let free = agreement.parts[model.parts[j]];
        let (reason, value) = if free > settings.free {
            (ConfidenceReason::InFreeSpace, (1.0 - free) * share)
        } else if readings[bone] == 0 && missing[bone] == 0 {
            (ConfidenceReason::Unseen, 0.0)
        } else if readings[bone] == 0 {
            (ConfidenceReason::NoReturn, 0.0)
        } else if missing[bone] > readings[bone] {
            (
                ConfidenceReason::NoReturn,
                settings.no_return_factor * share,
            )
        } else if !angles.is_empty() && least < settings.ambiguous {
            (
                ConfidenceReason::Ambiguous,
                settings.ambiguous_factor * share,
            )
        } else if at_limit {
            (ConfidenceReason::AtLimit, settings.at_limit_factor * share)
        } else {
            (ConfidenceReason::Measured, share)
        };
        JointConfidence { value, reason }
    };
    (0..skeleton.len()).map(of_joint).collect()
}

/// Samples of each bone that found a reading.
fn paired_samples(context: &FitContext<'_>, scratch: &FitScratch) -> Vec<u32> {
    let mut counts = vec![0u32; context.model.parents.len()];
    for pair in scratch.pairs.iter().filter(|p| !p.from_data) {
        counts[usize::from(context.model.bones[pair.model as usize])] += 1;
    }
    counts
}

/// Visible samples of each bone at cells without any reading.
fn samples_without_return(context: &FitContext<'_>, scratch: &FitScratch) -> Vec<u32> {
    let settings = &context.model.config.assess.confidence;
    let grid = context.observation.grid;
    let image = &scratch.pairing.image;
    let mut counts = vec![0u32; context.model.parents.len()];
    for (i, (p, normal)) in scratch.positions.iter().zip(&scratch.normals).enumerate() {
        if normal.dot(&p.coords) >= 0.0 {
            continue;
        }
        let Some(cell) = grid.cell_of(p).and_then(|(u, v)| grid.cell(u, v)) else {
            continue;
        };
        if grid.labels[cell] == Label::Unknown && p.z <= image.depth[cell] + settings.hidden {
            counts[usize::from(context.model.bones[i])] += 1;
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assess::agreement::AgreementScratch;
    use crate::fit::fit_pose;
    use crate::test_scene::{DepthScan, TestScene};

    #[test]
    fn a_limb_in_the_air_says_so_and_the_others_do_not() {
        let scene = TestScene::new(1000, 480);
        let skeleton = scene.model.template.skeleton();
        let scan = DepthScan::new(&scene.model, &scene.depth(&scene.pose)).background_removed();
        let (body, observation) = (scene.body(), scan.observation());
        let context = scene.context(&body, &observation);
        let mut scratch = FitScratch::default();
        let mut pose = scene.pose.clone();
        let track = &context.model.config.fit.track;
        fit_pose(&context, &mut pose, track, &mut scratch);
        pose.set(skeleton, "left_shoulder", &[0.0, 0.0, 1.2]);
        let agreement = AgreementScratch::default().measure(&context, &pose, &mut scratch);
        let joints = confidence(&context, &pose, &scratch, &agreement);

        let of = |name: &str| joints[skeleton.index(name).expect(name)];
        for (left, right) in [("left_elbow", "right_elbow"), ("left_wrist", "right_wrist")] {
            let (left, right) = (of(left), of(right));
            assert_eq!(left.reason, ConfidenceReason::InFreeSpace);
            assert_ne!(right.reason, ConfidenceReason::InFreeSpace);
            assert!(left.value < 0.6 * right.value, "{left:?} {right:?}");
        }
    }
}
