//! Feet that nobody sees stand on the floor: where a picture ends at the knees, the height of the knees over the floor
//! tells how much they bend.

use super::align::AlignScratch;
use super::model::TrackerModel;
use crate::body::{BoneTransforms, JointMotion, Pose, RestBody, Template};
use crate::math::P3d;
use crate::spatial::{Label, OrganisedCloud};
use nalgebra::Vector3;

/// One leg of the template.
#[derive(Clone, Debug)]
pub(super) struct Leg {
    /// Hip joint.
    hip: usize,
    /// Its hinged knee: angle and limits.
    knee: Option<(usize, [f64; 2])>,
    /// Joints that have a known height over the floor in a standing foot, and that height, metres.
    soles: Vec<(usize, f64)>,
    /// Angles that move them.
    angles: Vec<usize>,
}

/// The floor under the person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ground {
    /// Unit vector against gravity, camera frame.
    pub up: Vector3<f64>,
    /// Height of the floor along it, metres.
    pub height: f64,
}

/// Weight of a standing foot, per point: against a knee that nothing is seen of (2·10⁻⁵ per squared radian at a lever of
/// 40 cm) it decides, against a seen one it has no say at all.
const STANDING: f64 = 1e-2;
/// Width of its kernel, metres: a foot on a stool is not on the floor.
const KERNEL: f64 = 0.15;
/// The greatest height of the hips follows a greater one by this share of the difference a frame.
const RISE: f64 = 0.1;

/// The legs of a template; empty for one without.
pub(super) fn legs(template: &Template) -> Vec<Leg> {
    let skeleton = template.skeleton();
    let Some((lowest, _)) = template.mesh().bounds() else { return Vec::new() };
    let leg = |side: &str| {
        let at = |part: &str| skeleton.index(&format!("{side}_{part}"));
        let (hip, ankle) = (at("hip")?, at("ankle")?);
        let height = |j: usize| (j, skeleton.joints()[j].rest.y - f64::from(lowest.y));
        let soles: Vec<_> = std::iter::once(ankle).chain(at("foot")).map(height).collect();
        let moves = |j: usize| soles.iter().any(|(s, _)| skeleton.is_ancestor(j, *s));
        let below = (hip..skeleton.len()).filter(|&j| skeleton.is_ancestor(hip, j) && moves(j));
        let angles = below.flat_map(|j| (0..skeleton.joints()[j].motion.dofs()).map(move |k| (j, k)));
        let angles = angles.map(|(j, k)| skeleton.dof_offset(j) + k).collect();
        let knee = at("knee").and_then(|k| match skeleton.joints()[k].motion {
            JointMotion::Hinge { limits, .. } => Some((skeleton.dof_offset(k), limits)),
            _ => None,
        });
        Some(Leg { hip, knee, soles, angles })
    };
    ["left", "right"].into_iter().filter_map(leg).collect()
}

/// A joint before something measured is followed, not guessed; where the picture shows nothing it may stand.
fn in_view(grid: &OrganisedCloud, joint: &P3d) -> bool {
    let home = grid.cell_of(&joint.cast()).and_then(|(u, v)| grid.cell(u, v));
    home.is_some_and(|k| grid.labels[k] != Label::Unknown)
}

/// Adds standing feet to the normal equations of `scratch`; `unseen` is the share (0 to 1) of each angle that no reading
/// holds. Only such angles move.
pub(super) fn stand(
    model: &TrackerModel,
    grid: &OrganisedCloud,
    ground: &Ground,
    unseen: &[f64],
    scratch: &mut AlignScratch,
) {
    let centre = scratch.bones.joints[0].coords;
    for leg in &model.standing {
        for &(joint, height) in &leg.soles {
            let at = scratch.bones.joints[joint];
            if in_view(grid, &at) {
                continue;
            }
            let p = at.coords;
            let off = ground.height + height - ground.up.dot(&p);
            let weight = STANDING * (KERNEL * KERNEL / (KERNEL * KERNEL + off * off)).powi(2);
            let slope = |&k: &usize| {
                let dof = &scratch.dofs[6 + k];
                let moves = model.template.skeleton().is_ancestor(dof.bone, joint);
                if moves { ground.up.dot(&dof.twist.velocity_at(&(p - centre))) * unseen[k] } else { 0.0 }
            };
            let slopes: Vec<f64> = leg.angles.iter().map(slope).collect();
            scratch.add_row(&leg.angles, &slopes, off, weight);
        }
    }
}

/// A hidden foot this far below the floor, metres, is looked for again: from a straight leg the way to a bent one leads
/// down first.
const BELOW: f64 = 0.03;
/// Knee angles that are tried, radians apart.
const BENDS: f64 = 0.05;
/// Share of a knee (0 to 1) that no reading holds, from which its bend is free to choose.
const FREE: f64 = 0.5;

/// Bends hidden knees whose feet are below the floor by the least that brings them up to it. `scratch` knows of the last
/// normal equations.
pub(super) fn unfold(
    model: &TrackerModel,
    rest: &RestBody,
    grid: &OrganisedCloud,
    ground: &Ground,
    scratch: &AlignScratch,
    pose: &mut Pose,
) {
    let skeleton = model.template.skeleton();
    let mut bones = BoneTransforms::default();
    for leg in &model.standing {
        let (Some((knee, limits)), Some(&(ankle, height))) = (leg.knee, leg.soles.first()) else { continue };
        if scratch.unseen(knee) < FREE {
            continue;
        }
        if in_view(grid, &scratch.bones.joints[ankle]) {
            continue;
        }
        let mut below = |pose: &Pose| {
            pose.bones(skeleton, rest, &mut bones);
            ground.height + height - ground.up.dot(&bones.joints[ankle].coords)
        };
        if below(pose) < BELOW {
            continue;
        }
        let mut bent = pose.clone();
        while bent.angles[knee] + BENDS < limits[1] {
            bent.angles[knee] += BENDS;
            if below(&bent) < 0.0 {
                *pose = bent;
                break;
            }
        }
    }
}

/// Height of the hips along `up`, metres, at the pose of `scratch`; `known` is the greatest so far, which follows a
/// greater one by and by.
pub(super) fn tallest(
    model: &TrackerModel,
    up: &Vector3<f64>,
    known: Option<f64>,
    scratch: &AlignScratch,
) -> Option<f64> {
    let hip = |leg: &Leg| scratch.bones.joints.get(leg.hip).map(|p| up.dot(&p.coords));
    let hips = model.standing.iter().filter_map(hip);
    let height = hips.fold(None, |a: Option<f64>, b| Some(a.map_or(b, |a| a.min(b))))?;
    Some(known.map_or(height, |k| k + RISE * (height - k).max(0.0)))
}

/// Where the floor is when none is seen: nobody's feet reach lower than his straight legs, and with the hips at their
/// highest he stands on them.
pub(super) fn below(model: &TrackerModel, rest: &RestBody, tallest: f64) -> Option<f64> {
    let length = |leg: &Leg| {
        let &(ankle, height) = leg.soles.first()?;
        Some(rest.joints.get(leg.hip)?.y - rest.joints.get(ankle)?.y + height)
    };
    let longest = model.standing.iter().filter_map(length).fold(0.0, f64::max);
    (longest > 0.0).then_some(tallest - longest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Calibration, Intrinsics};
    use crate::tracking::{TrackerConfig, TrackerState};

    fn standing() -> (TrackerModel, RestBody, Pose, AlignScratch) {
        let camera = Intrinsics { height: 200, ..Intrinsics::KINECT_V1 };
        let config = TrackerConfig { samples: 50, ..TrackerConfig::default() };
        let model = TrackerModel::new(crate::body::embedded::template(), Calibration::registered(camera), config);
        let rest = model.template.personalise(&Default::default());
        let pose = TrackerState::new(&model).pose;
        let mut scratch = AlignScratch::default();
        pose.bones(model.template.skeleton(), &rest, &mut scratch.bones);
        (model, rest, pose, scratch)
    }

    #[test]
    fn straight_legs_reach_the_soles() {
        let (model, rest, pose, scratch) = standing();
        let up = pose.root.iso().rotation * Vector3::y();
        assert_eq!(model.standing.len(), 2);
        let hips = tallest(&model, &up, None, &scratch).expect("hips");
        let floor = below(&model, &rest, hips).expect("legs");
        let lowest =
            rest.vertices.iter().map(|v| up.dot(&pose.root.point(&v.cast()).coords)).fold(f64::INFINITY, f64::min);
        assert!((floor - lowest).abs() < 0.02, "{floor} against {lowest}");
        // Lower hips are a bent knee, higher ones a better look.
        assert_eq!(tallest(&model, &up, Some(hips + 0.1), &scratch), Some(hips + 0.1));
        assert!(tallest(&model, &up, Some(hips - 0.1), &scratch).expect("hips") > hips - 0.1);
    }

    #[test]
    fn a_foot_below_the_floor_bends_the_hidden_knee() {
        let (model, rest, pose, mut scratch) = standing();
        let up = pose.root.iso().rotation * Vector3::y();
        let straight = below(&model, &rest, tallest(&model, &up, None, &scratch).expect("hips")).expect("legs");
        let ground = Ground { up, height: straight + 0.12 };
        let grid = OrganisedCloud::new(&model.calibration.depth, None);
        let (knee, limits) = model.standing[0].knee.expect("a hinge");
        // A knee that readings hold stays.
        let mut bent = pose.clone();
        unfold(&model, &rest, &grid, &ground, &scratch, &mut bent);
        assert_eq!(bent, pose);
        scratch.hide_all(pose.angles.len());
        unfold(&model, &rest, &grid, &ground, &scratch, &mut bent);
        assert!(bent.angles[knee] > 0.3 && bent.angles[knee] < limits[1], "{}", bent.angles[knee]);
        let mut bones = BoneTransforms::default();
        bent.bones(model.template.skeleton(), &rest, &mut bones);
        let (ankle, height) = model.standing[0].soles[0];
        let off = ground.height + height - up.dot(&bones.joints[ankle].coords);
        assert!((-0.03..=0.0).contains(&off), "{off}");
        // No floor can be reached by bending when it is above the knees: the leg stays as it was.
        let absurd = Ground { up, height: straight + 2.0 };
        let mut same = pose.clone();
        unfold(&model, &rest, &grid, &absurd, &scratch, &mut same);
        assert_eq!(same, pose);
    }
}
