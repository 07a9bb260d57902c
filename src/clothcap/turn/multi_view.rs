//! Joint registration of all frames: one twist per frame and part of the body, so that what two frames see of one place meets.
//!
//! Point-to-plane distances between each point and the nearest ones of frames at near yaws, in one Gauss–Newton system over
//! all frames: errors of the tracked poses are spread around the turn and its end meets its begin.

use super::fused_cloud::FusedPoint;
use super::moving_parts::MovingParts;
use crate::CaptureError;
use crate::dense_equations::DenseEquations;
use crate::settings::{MultiViewSettings, TurnConfig};
use nalgebra::{DVector, Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};
use std::f64::consts::TAU;
use tryon_geometry::math::{P3, P3d};
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::PointTree;
use tryon_tracking::registration::GemanMcClure;

/// Unknowns of a part in a frame.
const DOFS: usize = 6;

/// Points of one frame in the pose of the reference.
pub(super) struct RegisteredFrame {
    pub(super) points: Vec<FusedPoint>,
    /// Yaw at which they were seen, radians.
    pub(super) yaw: f64,
    /// Joints as each part moves them: the parent's and own position, metres.
    joints: Vec<[P3d; 2]>,
    /// Turn of each part so far, radians.
    turns: Vec<Vector3<f64>>,
    /// Mean robust distance from other frames, metres.
    pub(super) error: f64,
}

impl RegisteredFrame {
    pub(super) fn new(
        points: Vec<FusedPoint>,
        yaw: f64,
        parts: &MovingParts,
        joints: &[P3d],
    ) -> Self {
        Self {
            points,
            yaw,
            joints: parts.joints.iter().map(|j| [joints[*j]; 2]).collect(),
            turns: vec![Vector3::zeros(); parts.len()],
            error: 0.0,
        }
    }
}

/// A point of one frame and the plane of another through the nearest point.
#[derive(Clone, Copy)]
struct ViewPair {
    frames: [usize; 2],
    points: [usize; 2],
    weight: f64,
    distance: f64,
}

/// Moves the points of all frames until they meet; those of `reference` stay.
pub(super) fn register(
    frames: &mut [RegisteredFrame],
    parts: &MovingParts,
    reference: usize,
    config: &TurnConfig,
) -> Result<(), CaptureError> {
    let settings = &config.views;
    for k in 0..config.iterations {
        let t = k as f64 / (config.iterations - 1).max(1) as f64;
        let between = |[a, b]: [f64; 2]| a * (b / a).powf(t);
        let [reach, sigma] = [settings.reach, settings.sigma].map(between);
        let pairs = pair(frames, reach, sigma, settings);
        let update = solve(frames, parts, reference, &pairs, settings)?;
        apply(frames, parts, &update);
    }
    measure(frames, settings);
    Ok(())
}

pub(super) fn measure(frames: &mut [RegisteredFrame], settings: &MultiViewSettings) {
    let pairs = pair(frames, settings.reach[0], settings.sigma[0], settings);
    for (k, frame) in frames.iter_mut().enumerate() {
        let own = || pairs.iter().filter(|p| p.frames[0] == k);
        let sum: f64 = own().map(|p| p.distance.abs()).sum();
        frame.error = sum / own().count().max(1) as f64;
    }
}

/// Pairs up to a length of `reach`, with a kernel of width `sigma`, metres.
fn pair(
    frames: &[RegisteredFrame],
    reach: f64,
    sigma: f64,
    settings: &MultiViewSettings,
) -> Vec<ViewPair> {
    let overlap = |a: f64, b: f64| {
        let d = (a - b).rem_euclid(TAU);
        d.min(TAU - d) < settings.overlap
    };
    let cloud = |f: &RegisteredFrame| f.points.iter().map(|p| p.point).collect();
    let clouds: Vec<Vec<P3>> = frames.iter().map(cloud).collect();
    let trees: Vec<PointTree> = clouds.iter().map(|c| PointTree::new(c)).collect();
    let kernel = GemanMcClure { sigma };
    let mut out = Vec::new();
    for (a, frame) in frames.iter().enumerate() {
        let stride = (frame.points.len() / settings.samples).max(1);
        let mut found = Vec::new();
        let count = frame.points.len().div_ceil(stride);
        par::map_into(Par::Rayon, count, 32, &mut found, |k| {
            let i = k * stride;
            let p = &frame.points[i];
            let others =
                (0..frames.len()).filter(|b| *b != a && overlap(frame.yaw, frames[*b].yaw));
            let near = others.filter_map(|b| {
                let (j, _) = trees[b].nearest(&p.point, reach as f32)?;
                let q = &frames[b].points[j];
                let distance = f64::from(q.normal.dot(&(p.point - q.point)));
                (p.normal.dot(&q.normal) > settings.normals).then(|| ViewPair {
                    frames: [a, b],
                    points: [i, j],
                    weight: kernel.weight(distance * distance) * f64::from(p.weight * q.weight),
                    distance,
                })
            });
            near.collect::<Vec<_>>()
        });
        out.extend(found.into_iter().flatten());
    }
    out
}

/// Twists of all frames and parts, shape `[frames × parts × 6]`: translation, then rotation about the origin.
fn solve(
    frames: &[RegisteredFrame],
    parts: &MovingParts,
    reference: usize,
    pairs: &[ViewPair],
    settings: &MultiViewSettings,
) -> Result<DVector<f64>, CaptureError> {
    let n = frames.len() * parts.len() * DOFS;
    let mut system = DenseEquations::zeros(n);
    let deviation = settings.deviation;
    let scale = settings.independent * frames.len() as f64
        / (pairs.len().max(1) as f64 * deviation * deviation);
    for p in pairs {
        let q = &frames[p.frames[1]].points[p.points[1]];
        let normal = q.normal.cast::<f64>();
        let mut row: Vec<(usize, f64)> = Vec::with_capacity(48);
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let point = &frames[p.frames[side]].points[p.points[side]];
            let moment = point.point.coords.cast::<f64>().cross(&normal);
            for (part, share) in point.parts() {
                let first = (p.frames[side] * parts.len() + part) * DOFS;
                for c in 0..3 {
                    row.push((first + c, sign * share * normal[c]));
                    row.push((first + 3 + c, sign * share * moment[c]));
                }
            }
        }
        system.add_row(&row, p.distance, scale * p.weight);
    }
    add_priors(frames, parts, reference, &mut system, settings);
    system.solve("registration of frames")
}

fn add_priors(
    frames: &[RegisteredFrame],
    parts: &MovingParts,
    reference: usize,
    system: &mut DenseEquations,
    settings: &MultiViewSettings,
) {
    let weight = |deviation: f64| 1.0 / (deviation * deviation);
    for (k, frame) in frames.iter().enumerate() {
        let at = |part: usize| (k * parts.len() + part) * DOFS;
        let is_held = k == reference;
        let step = if is_held {
            settings.held
        } else {
            settings.step
        };
        for i in at(0)..at(parts.len()) {
            system.h[(i, i)] += weight(step);
        }
        for part in 1..parts.len() {
            let [of_parent, own] = frame.joints[part];
            let parent = parts.parents[part];
            // Joint stays one: the parent's motion of it less the part's.
            for axis in 0..3 {
                let e = Vector3::from_fn(|i, _| f64::from(u8::from(i == axis)));
                let mut row = Vec::with_capacity(12);
                for (first, joint, sign) in [(at(parent), of_parent, 1.0), (at(part), own, -1.0)] {
                    let moment = joint.coords.cross(&e);
                    row.push((first + axis, sign));
                    row.extend((0..3).map(|c| (first + 3 + c, sign * moment[c])));
                }
                system.add_row(&row, of_parent[axis] - own[axis], weight(settings.joint));
                let turn = [(at(parent) + 3 + axis, 1.0), (at(part) + 3 + axis, -1.0)];
                let bend = frame.turns[parent][axis] - frame.turns[part][axis];
                system.add_row(&turn, bend, weight(settings.bend));
            }
        }
    }
}

fn apply(frames: &mut [RegisteredFrame], parts: &MovingParts, update: &DVector<f64>) {
    for (k, frame) in frames.iter_mut().enumerate() {
        let motion = |part: usize| -> Isometry3<f64> {
            let first = (k * parts.len() + part) * DOFS;
            let x: Vector6<f64> = update.fixed_rows::<6>(first).into_owned();
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(x[3], x[4], x[5]));
            Isometry3::from_parts(Translation3::new(x[0], x[1], x[2]), turn)
        };
        let motions: Vec<_> = (0..parts.len()).map(motion).collect();
        frame.points.iter_mut().for_each(|p| p.blend(&motions));
        for (part, joint) in frame.joints.iter_mut().enumerate() {
            *joint = [
                motions[parts.parents[part]] * joint[0],
                motions[part] * joint[1],
            ];
            frame.turns[part] += motions[part].rotation.scaled_axis();
        }
    }
}
