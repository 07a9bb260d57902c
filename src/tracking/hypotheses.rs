//! Poses of arms and legs to try: a fixed handful of arms, and limbs that end where the body ends in the picture.

use super::align::{AlignScratch, SampleRest, Seen, aim, evaluate};
use super::limb::Limb;
use super::model::TrackerModel;
use crate::body::{BoneTransforms, Pose, RestBody};
use crate::math::{P3, P3d, exp_so3};
use crate::segment::{Extremity, extremities};
use nalgebra::Vector3;

/// Directions of the upper arm that are tried (x outward, y up, z forward).
const UPPER_ARMS: [[f64; 3]; 9] = [
    [0.15, -0.99, 0.0],
    [0.4, -0.92, 0.0],
    [0.75, -0.65, -0.1],
    [1.0, 0.0, 0.0],
    [0.7, 0.7, 0.0],
    [0.25, 0.95, 0.15],
    [0.3, -0.75, 0.6],
    [0.3, -0.1, 0.95],
    [0.75, -0.2, 0.6],
];
/// Bends of the elbow, radians, tried in a first and a second round; and turns of the upper arm about itself.
const BENDS: [f64; 2] = [0.1, 1.4];
/// See [`BENDS`].
const MORE_BENDS: [f64; 3] = [0.7, 1.4, 2.2];
/// See [`BENDS`].
const TWISTS: [f64; 5] = [-1.8, -0.9, 0.0, 0.9, 1.8];
/// Turns of a thigh about itself that are tried with the knee at an end.
const LEG_TWISTS: [f64; 3] = [-0.9, 0.0, 0.9];
/// What a bend and a twist must earn, m² per point and squared radian: a straight arm explained by a bent one that is
/// turned inside out stays so for good. A hand of ten readings is worth 7·10⁻⁵.
const BEND_COST: f64 = 1e-5;
/// See [`BEND_COST`].
const TWIST_COST: f64 = 3e-5;
/// Upper arms that go into the second round.
const ARM_FINALISTS: usize = 3;

/// Ends of the body that are looked at: head, hands, feet, and elbows of hands that lie on the body.
const ENDS: usize = 7;
/// An end farther from a limb's root than the limb is long times this is not this limb's.
const STRETCH: f64 = 1.15;
/// An end lies on the skin, its joint this far behind it, metres.
const BEHIND: f64 = 0.02;
/// Reach of the comparison of poses, metres.
const REACH: f32 = 0.15;

/// The ends of the body that is seen around `torso` (camera frame).
pub(super) fn ends(seen: &Seen<'_>, torso: &P3) -> Vec<Extremity> {
    extremities(seen.grid, seen.cells, torso, ENDS)
}

/// A point of the skin moved to where the bone is.
fn inside(p: &P3) -> P3d {
    let p = p.cast::<f64>();
    p + p.coords.try_normalize(0.0).unwrap_or_else(Vector3::z) * BEHIND
}

/// The arm pose of one side (0 left, 1 right) that explains the picture best.
pub(super) fn choose_arm(
    model: &TrackerModel,
    rest: (&RestBody, &SampleRest),
    pose: &Pose,
    seen: &Seen<'_>,
    side: usize,
    ends: &[Extremity],
    scratch: &mut AlignScratch,
) -> Pose {
    let Some(arm) = &model.arms[side] else {
        return pose.clone();
    };
    let skeleton = model.template.skeleton();
    let sign = [1.0, -1.0][side];
    let (shoulder, elbow) = (
        &skeleton.joints()[arm.root].name,
        &skeleton.joints()[arm.hinge].name,
    );
    let mut tried: Vec<(f64, Option<Vector3<f64>>, Pose)> = Vec::new();
    for pose in at_ends(model, rest.0, pose, arm, ends) {
        let cost = evaluate(model, rest, &pose, seen, REACH, scratch).cost;
        tried.push((cost + effort(model, &pose, arm), None, pose));
    }
    let mut guess = |d: Vector3<f64>, bend: f64, twist: f64| {
        let mut guess = pose.clone();
        aim(model, &mut guess, shoulder, elbow, d, twist * sign);
        guess.set(skeleton, elbow, &[bend]);
        guess.clamp_to_limits(skeleton);
        let effort = BEND_COST * bend * bend + TWIST_COST * twist * twist;
        (
            evaluate(model, rest, &guess, seen, REACH, scratch).cost + effort,
            guess,
        )
    };
    let outward = |d: [f64; 3]| Vector3::new(d[0] * sign, d[1], d[2]).normalize();
    let mut directions: Vec<Vector3<f64>> = UPPER_ARMS.into_iter().map(outward).collect();
    // An end may be the elbow, and the way to one passes it.
    let lower = (rest.0.joints[arm.tip] - rest.0.joints[arm.hinge]).norm() as f32;
    let elbows = ends.iter().flat_map(|e| [e.point, e.along(lower)]);
    directions.extend(towards(model, rest.0, pose, arm, elbows));
    for direction in directions {
        for bend in BENDS {
            let (cost, pose) = guess(direction, bend, 0.0);
            tried.push((cost, Some(direction), pose));
        }
    }
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut finalists: Vec<Vector3<f64>> = Vec::new();
    for direction in tried.iter().filter_map(|t| t.1) {
        if finalists.len() < ARM_FINALISTS && !finalists.contains(&direction) {
            finalists.push(direction);
        }
    }
    for direction in finalists {
        for bend in MORE_BENDS {
            for twist in TWISTS {
                let (cost, pose) = guess(direction, bend, twist);
                tried.push((cost, None, pose));
            }
        }
    }
    tried
        .into_iter()
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(|| pose.clone(), |t| t.2)
}

/// The leg pose of one side (0 left, 1 right) that explains the picture best: as it is, with the knee bent, with the foot
/// or the knee at an end.
pub(super) fn choose_leg(
    model: &TrackerModel,
    rest: (&RestBody, &SampleRest),
    pose: &Pose,
    seen: &Seen<'_>,
    side: usize,
    ends: &[Extremity],
    scratch: &mut AlignScratch,
) -> Pose {
    let Some(leg) = &model.legs[side] else {
        return pose.clone();
    };
    let skeleton = model.template.skeleton();
    let (hip, knee) = (
        &skeleton.joints()[leg.root].name,
        &skeleton.joints()[leg.hinge].name,
    );
    let mut guesses = at_ends(model, rest.0, pose, leg, ends);
    let directions = towards(model, rest.0, pose, leg, ends.iter().map(|e| e.point));
    for bend in MORE_BENDS {
        let mut bent = pose.clone();
        bent.set(skeleton, knee, &[bend]);
        guesses.push(bent);
        for &direction in &directions {
            for twist in LEG_TWISTS {
                let mut guess = pose.clone();
                aim(model, &mut guess, hip, knee, direction, twist);
                guess.set(skeleton, knee, &[bend]);
                guess.clamp_to_limits(skeleton);
                guesses.push(guess);
            }
        }
    }
    let mut best = (
        evaluate(model, rest, pose, seen, REACH, scratch).cost,
        pose.clone(),
    );
    for pose in guesses {
        let cost =
            evaluate(model, rest, &pose, seen, REACH, scratch).cost + effort(model, &pose, leg);
        if cost < best.0 {
            best = (cost, pose);
        }
    }
    best.1
}

/// What the pose of a limb must earn; see [`BEND_COST`].
fn effort(model: &TrackerModel, pose: &Pose, limb: &Limb) -> f64 {
    let joints = model.template.skeleton().joints();
    let Some(child) = joints.iter().position(|j| j.parent == Some(limb.root)) else {
        return 0.0;
    };
    // The part of the root's turn that is about its own bone (swing and twist).
    let along = (joints[child].rest - joints[limb.root].rest).normalize();
    let turn = Vector3::new(
        pose.angles[limb.angles[0]],
        pose.angles[limb.angles[1]],
        pose.angles[limb.angles[2]],
    );
    let turn = exp_so3(&turn);
    let twist = 2.0 * (turn.imag().dot(&along) / turn.w.abs().max(f64::MIN_POSITIVE)).atan();
    let bend = pose.angles[limb.angles[3]];
    BEND_COST * bend * bend + TWIST_COST * twist * twist
}

/// Where the root of a limb and its parent bone are.
fn root_of(
    model: &TrackerModel,
    rest: &RestBody,
    pose: &Pose,
    limb: &Limb,
) -> (P3d, nalgebra::UnitQuaternion<f64>) {
    let mut bones = BoneTransforms::default();
    pose.bones(model.template.skeleton(), rest, &mut bones);
    let parent =
        model.parents[limb.root].map_or(pose.root.iso().rotation, |p| bones.bones[p].rotation);
    (bones.joints[limb.root], parent)
}

/// Poses with the limb's end at each end that it can reach, its hinge where the way along the surface says. (Turned by
/// right angles from there too, the real stills had 78.1 instead of 79.1 % of their joints within 10 cm.)
fn at_ends(
    model: &TrackerModel,
    rest: &RestBody,
    pose: &Pose,
    limb: &Limb,
    ends: &[Extremity],
) -> Vec<Pose> {
    let (root, _) = root_of(model, rest, pose, limb);
    let lower = (rest.joints[limb.tip] - rest.joints[limb.hinge]).norm();
    let mut out = Vec::new();
    for end in ends {
        let target = inside(&end.point);
        let line = target - root;
        if line.norm() > STRETCH * limb.length(rest) || line.norm() < f64::EPSILON {
            continue;
        }
        let mut guess = pose.clone();
        limb.reach(
            model,
            rest,
            &mut guess,
            &target,
            Some(&inside(&end.along(lower as f32))),
        );
        out.push(guess);
    }
    out
}

/// Directions (rest frame of the parent bone) from the limb's root to those of `points` that may be its hinge.
fn towards(
    model: &TrackerModel,
    rest: &RestBody,
    pose: &Pose,
    limb: &Limb,
    points: impl Iterator<Item = P3>,
) -> Vec<Vector3<f64>> {
    let (root, parent) = root_of(model, rest, pose, limb);
    let upper = (rest.joints[limb.hinge] - rest.joints[limb.root]).norm();
    let near = |p: &P3d| (0.5..1.4).contains(&((p - root).norm() / upper));
    points
        .map(|p| inside(&p))
        .filter(near)
        .map(|p| (parent.inverse() * (p - root)).normalize())
        .collect()
}
