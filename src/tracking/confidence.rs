//! How sure each joint is, and why not.

use super::align::{AlignScratch, Seen};
use super::model::TrackerModel;
use crate::body::{JointMotion, Pose};
use crate::spatial::Label;
use serde::{Deserialize, Serialize};

/// What a joint's angles rest on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// Readings of its own bone.
    Measured,
    /// An angle is at the end of its range.
    AtLimit,
    /// Its bone is seen, but some way of turning changes nothing in the picture (a twist, a limb along the view).
    Ambiguous,
    /// Its bone should be in view, but the camera got no readings there (black trousers, shiny things).
    NoReturn,
    /// Its bone is behind something or outside the picture.
    Unseen,
}

/// Confidence of one joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointConfidence {
    /// 0 (a guess) to 1 (well measured).
    pub value: f32,
    /// What holds it back.
    pub reason: Reason,
}

/// A bone with so many readings is half sure.
const HALF_SURE: f32 = 4.0;
/// A degree of freedom with less data than this (per point, m²/rad²) is ambiguous: a twentieth of a shank in view.
const AMBIGUOUS: f64 = 3e-5;
/// Nearer to a limit than this, radians, is at the limit.
const LIMIT: f64 = 1e-3;
/// A model point this far behind the drawn model (metres) is hidden by it.
const HIDDEN: f32 = 0.05;

/// Confidence of every joint of the skeleton, from the last pairing and normal equations.
pub(super) fn confidence(
    model: &TrackerModel,
    pose: &Pose,
    seen: &Seen<'_>,
    scratch: &AlignScratch,
) -> Vec<JointConfidence> {
    let skeleton = model.template.skeleton();
    let n = skeleton.len();
    let (mut readings, mut missing) = (vec![0u32; n], vec![0u32; n]);
    for pair in scratch.pairs.iter().filter(|p| !p.from_data) {
        readings[usize::from(model.bones[pair.model as usize])] += 1;
    }
    let image = &scratch.pairing.image;
    for (i, (p, normal)) in scratch.positions.iter().zip(&scratch.normals).enumerate() {
        if normal.dot(&p.coords) >= 0.0 {
            continue;
        }
        let Some(cell) = seen.grid.cell_of(p).and_then(|(u, v)| seen.grid.cell(u, v)) else {
            continue;
        };
        if seen.grid.labels[cell] == Label::Unknown && p.z <= image.depth[cell] + HIDDEN {
            missing[usize::from(model.bones[i])] += 1;
        }
    }
    let limits = skeleton.limits();
    (0..n)
        .map(|j| {
            let at = skeleton.dof_offset(j);
            let dofs = skeleton.joints()[j].motion.dofs();
            // End points and unskinned joints speak for the bone that carries them.
            let bone =
                if matches!(skeleton.joints()[j].motion, JointMotion::Fixed) && readings[j] == 0 {
                    model.parents[j].unwrap_or(j)
                } else {
                    j
                };
            let seen_share = readings[bone] as f32 / (readings[bone] as f32 + HALF_SURE);
            let least = (at..at + dofs)
                .map(|k| scratch.information(6 + k))
                .fold(f64::INFINITY, f64::min);
            let at_limit = (at..at + dofs).any(|k| {
                pose.angles[k] - limits[k][0] < LIMIT || limits[k][1] - pose.angles[k] < LIMIT
            });
            let (reason, value) = if readings[bone] == 0 {
                (
                    if missing[bone] > 0 {
                        Reason::NoReturn
                    } else {
                        Reason::Unseen
                    },
                    0.0,
                )
            } else if missing[bone] > readings[bone] {
                (Reason::NoReturn, 0.5 * seen_share)
            } else if dofs > 0 && least < AMBIGUOUS {
                (Reason::Ambiguous, 0.7 * seen_share)
            } else if at_limit {
                (Reason::AtLimit, 0.8 * seen_share)
            } else {
                (Reason::Measured, seen_share)
            };
            JointConfidence { value, reason }
        })
        .collect()
}
