//! Feet that nobody sees stand on the floor: where a picture ends at the knees, the height of the knees over the floor
//! tells how much they bend, and while the thighs show, the feet stay where they stood.

use super::align::AlignScratch;
use super::model::TrackerModel;
use crate::body::{BoneTransforms, JointMotion, Pose, RestBody, Template};
use crate::math::P3d;
use crate::registration::Dof;
use crate::spatial::{Label, OrganisedCloud};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// One leg of the template.
#[derive(Clone, Debug)]
pub(super) struct Leg {
    /// Hip joint.
    hip: usize,
    /// Its hinged knee: angle and limits.
    knee: Option<(usize, [f64; 2])>,
    /// Its knee joint.
    bend: Option<usize>,
    /// Joints that have a known height over the floor in a standing foot, and that height, metres.
    soles: Vec<(usize, f64)>,
    /// Angles that move them.
    angles: Vec<usize>,
}

impl Leg {
    /// Whether an angle moves its foot.
    pub(super) fn moves(&self, angle: usize) -> bool {
        self.angles.contains(&angle)
    }
}

/// The floor under the person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ground {
    /// Unit vector against gravity, camera frame.
    pub up: Vector3<f64>,
    /// Height of the floor along it, metres.
    pub height: f64,
    /// Where the feet stood.
    pub feet: Option<Feet>,
}

/// Ankle and ball of each foot of [`TrackerModel::standing`], camera frame, metres; zero for a joint that the template
/// does not have.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Feet([[Vector3<f64>; 2]; 2]);

impl Feet {
    /// Where they are with these joints.
    pub(super) fn of(model: &TrackerModel, joints: &[P3d]) -> Self {
        let mut out = [[Vector3::zeros(); 2]; 2];
        for (side, leg) in out.iter_mut().zip(&model.standing) {
            for (at, p) in side
                .iter_mut()
                .zip(leg.soles.iter().filter_map(|&(j, _)| joints.get(j)))
            {
                *at = p.coords;
            }
        }
        Self(out)
    }
    /// The memory a frame later.
    pub(super) fn followed(self, now: Self) -> Self {
        let mut out = self;
        for (kept, (was, is)) in out.0.iter_mut().zip(self.0.iter().zip(&now.0)) {
            let ankle = was[0] + (is[0] - was[0]) * FOLLOWS[0];
            let (before, after) = (was[1] - was[0], is[1] - is[0]);
            *kept = [ankle, ankle + before + (after - before) * FOLLOWS[1]];
        }
        out
    }
}

/// Weight of the height of a standing foot, per point: against a knee that nothing is seen of (2·10⁻⁵ per squared radian
/// at a lever of 40 cm) it decides, against a seen one it has no say at all.
const STANDING: f64 = 1e-2;
/// The same while the thigh shows. The estimated floor is off by a centimetre or two, which an almost straight leg turns
/// into a decimetre of the foot: 8.7 / 8.0 / 7.8 / 7.8 mm on the waist-up sequence with its own body at 10 / 3 / 1 / 0.3
/// · 10⁻³, thighs only seen 12.4 / 12.9 / 15.0 / 15.2.
const STANDING_SEEN: f64 = 2e-3;
/// Weight of the place of a planted ankle, per point.
const PLANTED: f64 = 1e-3;
/// Weight of the direction in which a planted foot points, per point, at the distance of its ball from the ankle.
const POINTING: f64 = 1e-2;
/// The remembered place follows what was found by this share a frame, and the remembered direction by that share.
const FOLLOWS: [f64; 2] = [0.3, 0.05];
/// Width of its kernel, metres: a foot on a stool is not on the floor.
const KERNEL: f64 = 0.15;
/// The greatest height of the hips follows a greater one by this share of the difference a frame.
const RISE: f64 = 0.1;

/// The legs of a template; empty for one without.
pub(super) fn legs(template: &Template) -> Vec<Leg> {
    let skeleton = template.skeleton();
    let Some((lowest, _)) = template.mesh().bounds() else {
        return Vec::new();
    };
    let leg = |side: &str| {
        let at = |part: &str| skeleton.index(&format!("{side}_{part}"));
        let (hip, ankle) = (at("hip")?, at("ankle")?);
        let height = |j: usize| (j, skeleton.joints()[j].rest.y - f64::from(lowest.y));
        let soles: Vec<_> = std::iter::once(ankle)
            .chain(at("foot"))
            .map(height)
            .collect();
        let moves = |j: usize| soles.iter().any(|(s, _)| skeleton.is_ancestor(j, *s));
        let below = (hip..skeleton.len()).filter(|&j| skeleton.is_ancestor(hip, j) && moves(j));
        let angles =
            below.flat_map(|j| (0..skeleton.joints()[j].motion.dofs()).map(move |k| (j, k)));
        let angles = angles.map(|(j, k)| skeleton.dof_offset(j) + k).collect();
        let knee = at("knee").and_then(|k| match skeleton.joints()[k].motion {
            JointMotion::Hinge { limits, .. } => Some((skeleton.dof_offset(k), limits)),
            _ => None,
        });
        Some(Leg {
            hip,
            knee,
            bend: at("knee"),
            soles,
            angles,
        })
    };
    ["left", "right"].into_iter().filter_map(leg).collect()
}

/// A joint before something measured is followed, not guessed; where the picture shows nothing it may stand.
fn in_view(grid: &OrganisedCloud, joint: &P3d) -> bool {
    let home = grid
        .cell_of(&joint.cast())
        .and_then(|(u, v)| grid.cell(u, v));
    home.is_some_and(|k| grid.labels[k] != Label::Unknown)
}

/// Whether each leg's foot is out of view while half its thigh shows: then it stays where it stood. With less of a leg in
/// the picture nothing tells of a step, and it stays under the hips.
pub(super) fn planted(
    model: &TrackerModel,
    grid: &OrganisedCloud,
    scratch: &AlignScratch,
) -> [bool; 2] {
    let Some(ground) = &scratch.terms.ground else {
        return [false; 2];
    };
    let mut out = [ground.feet.is_some(); 2];
    for (planted, leg) in out.iter_mut().zip(&model.standing) {
        let joints = &scratch.bones.joints;
        let shows = |at: P3d| {
            grid.cell_of(&at.cast())
                .and_then(|(u, v)| grid.cell(u, v))
                .is_some()
        };
        let hidden = leg
            .soles
            .first()
            .is_some_and(|&(ankle, _)| !shows(joints[ankle]));
        *planted &= hidden
            && leg
                .bend
                .is_some_and(|knee| shows(nalgebra::center(&joints[leg.hip], &joints[knee])));
    }
    out
}

/// Adds standing feet to the normal equations of `scratch`; `unseen` is the share (0 to 1) of each angle that no reading
/// holds, `planted` says which feet stay in place. Only unseen angles move.
pub(super) fn stand(
    model: &TrackerModel,
    grid: &OrganisedCloud,
    ground: &Ground,
    unseen: &[f64],
    planted: [bool; 2],
    scratch: &mut AlignScratch,
) {
    let skeleton = model.template.skeleton();
    let centre = scratch.bones.joints[0].coords;
    let feet = ground.feet.map_or([[Vector3::zeros(); 2]; 2], |f| f.0);
    for ((leg, stays), feet) in model.standing.iter().zip(planted).zip(feet) {
        let row = |scratch: &mut AlignScratch,
                   (joint, from),
                   off: &Vector3<f64>,
                   along: &Vector3<f64>,
                   weight: f64| {
            let speed = |joint: usize, dof: &Dof| {
                let p = scratch.bones.joints[joint].coords - centre;
                if skeleton.is_ancestor(dof.bone, joint) {
                    dof.twist.velocity_at(&p)
                } else {
                    Vector3::zeros()
                }
            };
            let slope = |&k: &usize| {
                let dof = &scratch.dofs[6 + k];
                let moves = speed(joint, dof)
                    - Option::map_or_else(from, Vector3::zeros, |f| speed(f, dof));
                along.dot(&moves) * unseen[k]
            };
            let slopes: Vec<f64> = leg.angles.iter().map(slope).collect();
            scratch.add_row(&leg.angles, &slopes, along.dot(off), weight);
        };
        let (Some(&(ankle, _)), Some(across)) = (
            leg.soles.first(),
            ground.up.cross(&Vector3::z()).try_normalize(0.0),
        ) else {
            continue;
        };
        for (part, &(joint, height)) in leg.soles.iter().enumerate() {
            let at = scratch.bones.joints[joint];
            if in_view(grid, &at) {
                continue;
            }
            let off = ground.height + height - ground.up.dot(&at.coords);
            let weight = if stays { STANDING_SEEN } else { STANDING };
            let weight = weight * (KERNEL * KERNEL / (KERNEL * KERNEL + off * off)).powi(2);
            row(
                scratch,
                (joint, None),
                &(ground.up * off),
                &ground.up,
                weight,
            );
            if stays {
                // The ankle keeps its place, the ball of the foot its direction from it.
                let from = (part > 0).then_some(ankle);
                let kept = if part > 0 { feet[1] - feet[0] } else { feet[0] };
                let now = at.coords
                    - from.map_or_else(Vector3::zeros, |f| scratch.bones.joints[f].coords);
                let weight = if part > 0 { POINTING } else { PLANTED };
                for along in [across, ground.up.cross(&across)] {
                    row(scratch, (joint, from), &(kept - now), &along, weight);
                }
            }
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
        let (Some((knee, limits)), Some(&(ankle, height))) = (leg.knee, leg.soles.first()) else {
            continue;
        };
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
        let camera = Intrinsics {
            height: 200,
            ..Intrinsics::KINECT_V1
        };
        let config = TrackerConfig {
            samples: 50,
            ..TrackerConfig::default()
        };
        let model = TrackerModel::new(
            crate::body::embedded::template(),
            Calibration::registered(camera),
            config,
        );
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
        let lowest = rest
            .vertices
            .iter()
            .map(|v| up.dot(&pose.root.point(&v.cast()).coords))
            .fold(f64::INFINITY, f64::min);
        assert!((floor - lowest).abs() < 0.02, "{floor} against {lowest}");
        // Lower hips are a bent knee, higher ones a better look.
        assert_eq!(
            tallest(&model, &up, Some(hips + 0.1), &scratch),
            Some(hips + 0.1)
        );
        assert!(tallest(&model, &up, Some(hips - 0.1), &scratch).expect("hips") > hips - 0.1);
    }

    #[test]
    fn the_memory_of_feet_fades_as_it_should() {
        let x = |a: f64, b: f64| Feet([[Vector3::x() * a, Vector3::x() * (a + b)]; 2]);
        let mut kept = x(0.0, 0.1);
        assert_eq!(
            kept.followed(kept),
            kept,
            "who stands still is remembered as he stands"
        );
        for _ in 0..10 {
            kept = kept.followed(x(1.0, 0.2));
        }
        let [place, direction] = FOLLOWS.map(|f| (1.0 - f).powi(10));
        let [ankle, ball] = kept.0[0];
        assert!((ankle.x - (1.0 - place)).abs() < 1e-12, "{ankle}");
        assert!(
            (ball.x - ankle.x - (0.2 - 0.1 * direction)).abs() < 1e-12,
            "{ball}"
        );
    }

    /// Normal equations of standing feet alone.
    fn alone(
        model: &TrackerModel,
        rest: &RestBody,
        pose: &Pose,
        ground: Ground,
        scratch: &mut AlignScratch,
    ) -> [bool; 2] {
        pose.bones(model.template.skeleton(), rest, &mut scratch.bones);
        let grid = OrganisedCloud::new(&model.calibration.depth, None);
        scratch.terms.ground = Some(ground);
        scratch.blank(model, pose);
        let stays = planted(model, &grid, scratch);
        let unseen = vec![1.0; pose.angles.len()];
        stand(model, &grid, &ground, &unseen, stays, scratch);
        stays
    }

    #[test]
    fn hidden_feet_stay_when_the_pelvis_moves() {
        let (model, rest, pose, mut scratch) = standing();
        let skeleton = model.template.skeleton();
        let up = pose.root.iso().rotation * Vector3::y();
        let floor = below(
            &model,
            &rest,
            tallest(&model, &up, None, &scratch).expect("hips"),
        )
        .expect("legs");
        let feet = Feet::of(&model, &scratch.bones.joints);
        let ground = Ground {
            up,
            height: floor,
            feet: Some(feet),
        };
        // The camera of 200 rows, lifted until it sees the thighs but no feet.
        let lifted = |by: f64| {
            let mut p = pose.clone();
            p.root = crate::math::Rigid::new(nalgebra::Translation3::from(up * by) * p.root.iso());
            p
        };
        let offset = (0..60).map(|k| -0.6 + 0.02 * f64::from(k)).find(|&by| {
            let g = Ground {
                feet: Some(Feet(feet.0.map(|s| s.map(|v| v + up * by)))),
                height: floor + by,
                up,
            };
            alone(&model, &rest, &lifted(by), g, &mut scratch) == [true; 2]
        });
        let by = offset.expect("a height at which the picture ends between thigh and foot");
        let ground = Ground {
            feet: Some(Feet(feet.0.map(|s| s.map(|v| v + up * by)))),
            height: floor + by,
            ..ground
        };
        // He turns by 20° and shifts by 5 cm; only the legs may follow.
        let mut moved = lifted(by);
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(up * 0.35);
        let pelvis = moved.root.iso() * skeleton.joints()[0].rest;
        let shift = nalgebra::Translation3::from(pelvis.coords + Vector3::x() * 0.05);
        moved.root = crate::math::Rigid::new(
            shift * turn * nalgebra::Translation3::from(-pelvis.coords) * moved.root.iso(),
        );
        let off = |pose: &Pose| {
            let mut bones = BoneTransforms::default();
            pose.bones(skeleton, &rest, &mut bones);
            let now = Feet::of(&model, &bones.joints).0;
            let kept = ground.feet.expect("feet").0;
            (0..2)
                .map(|s| {
                    ((now[s][1] - now[s][0]) - (kept[s][1] - kept[s][0]))
                        .norm()
                        .max((now[s][0] - kept[s][0]).norm())
                })
                .fold(0.0, f64::max)
        };
        let before = off(&moved);
        for _ in 0..20 {
            alone(&model, &rest, &moved, ground, &mut scratch);
            scratch.follow(&model, &mut moved);
        }
        let after = off(&moved);
        assert!(before > 0.05 && after < 0.01, "{before} to {after}");
        // Nothing is remembered of a person who was just found.
        let fresh = Ground {
            feet: None,
            ..ground
        };
        assert_eq!(
            alone(&model, &rest, &moved, fresh, &mut scratch),
            [false; 2]
        );
    }

    #[test]
    fn a_foot_below_the_floor_bends_the_hidden_knee() {
        let (model, rest, pose, mut scratch) = standing();
        let up = pose.root.iso().rotation * Vector3::y();
        let straight = below(
            &model,
            &rest,
            tallest(&model, &up, None, &scratch).expect("hips"),
        )
        .expect("legs");
        let ground = Ground {
            up,
            height: straight + 0.12,
            feet: None,
        };
        let grid = OrganisedCloud::new(&model.calibration.depth, None);
        let (knee, limits) = model.standing[0].knee.expect("a hinge");
        // A knee that readings hold stays.
        let mut bent = pose.clone();
        unfold(&model, &rest, &grid, &ground, &scratch, &mut bent);
        assert_eq!(bent, pose);
        scratch.hide_all(pose.angles.len());
        unfold(&model, &rest, &grid, &ground, &scratch, &mut bent);
        assert!(
            bent.angles[knee] > 0.3 && bent.angles[knee] < limits[1],
            "{}",
            bent.angles[knee]
        );
        let mut bones = BoneTransforms::default();
        bent.bones(model.template.skeleton(), &rest, &mut bones);
        let (ankle, height) = model.standing[0].soles[0];
        let off = ground.height + height - up.dot(&bones.joints[ankle].coords);
        assert!((-0.03..=0.0).contains(&off), "{off}");
        // No floor can be reached by bending when it is above the knees: the leg stays as it was.
        let absurd = Ground {
            up,
            height: straight + 2.0,
            feet: None,
        };
        let mut same = pose.clone();
        unfold(&model, &rest, &grid, &absurd, &scratch, &mut same);
        assert_eq!(same, pose);
    }
}
