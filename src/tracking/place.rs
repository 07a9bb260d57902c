//! The first pose: where the body is by its outline and principal axes, then a handful of poses tried.

use super::align::{AlignScratch, Fit, START, SampleRest, Schedule, Seen, align, evaluate};
use super::hypotheses::{choose_arm, choose_leg, ends};
use super::model::TrackerModel;
use crate::body::{Pose, RestBody};
use crate::math::{P3, Rigid, principal_axes};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// What the outline says.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    /// Middle of the torso's front, camera frame.
    pub torso: P3,
    /// Top of the head.
    pub crown: P3,
    /// Height from the lowest to the highest reading, metres; `None` when cut off below.
    pub stature: Option<f64>,
}

/// Half the depth of a chest, metres: readings lie on the front, joints in the middle.
const HALF_DEPTH: f64 = 0.11;
/// The head is looked for this far to either side above the torso, metres.
const HEAD_BESIDE: f32 = 0.22;
/// Floor tolerance that segmentation takes from the soles, metres.
const SOLES: f64 = 0.02;
/// A floor that is this much higher than the lowest reading is not the one the person stands on, metres.
const AFLOAT: f64 = 0.1;
/// Turns about the vertical that are tried, radians; the paper asks for a frontal view.
const YAWS: [f64; 3] = [0.0, 0.6, -0.6];
/// How many of the best torsos get arms and are aligned in full.
const TORSO_FINALISTS: usize = 2;

/// Reads torso, crown and stature off the person's cells. `up` is the unit direction against gravity, `floor` the
/// camera's height over the floor, metres, where one is known.
pub(super) fn outline(
    seen: &Seen<'_>,
    up: &Vector3<f32>,
    cut_below: bool,
    floor: Option<f64>,
) -> Option<Outline> {
    let grid = seen.grid;
    let (columns, rows) = grid.size();
    // Chessboard distance to the nearest cell that is not the person; the torso is where it is largest.
    let mut inner = vec![0u16; columns * rows];
    for &c in seen.cells {
        inner[c as usize] = u16::MAX;
    }
    let mut relax = |cell: usize, neighbours: [(i32, i32); 4]| {
        if inner[cell] == 0 {
            return;
        }
        let (u, v) = ((cell % columns) as i32, (cell / columns) as i32);
        // Beyond the rim counts as outside, except below: a torso cut by the lower rim goes on.
        let least = neighbours
            .iter()
            .map(|(du, dv)| match grid.cell(u + du, v + dv) {
                Some(k) => inner[k],
                None if v + dv >= rows as i32 => u16::MAX - 1,
                None => 0,
            })
            .min();
        inner[cell] = inner[cell].min(least.unwrap_or(0).saturating_add(1));
    };
    for c in 0..columns * rows {
        relax(c, [(-1, 0), (0, -1), (-1, -1), (1, -1)]);
    }
    for c in (0..columns * rows).rev() {
        relax(c, [(1, 0), (0, 1), (1, 1), (-1, 1)]);
    }
    let usable = |c: usize| grid.depth[c] > 0.0;
    let widest = seen
        .cells
        .iter()
        .map(|&c| c as usize)
        .filter(|&c| usable(c))
        .map(|c| inner[c])
        .max()?;
    let (mut sum, mut n) = (Vector3::zeros(), 0.0f32);
    for &c in seen.cells {
        let c = c as usize;
        if usable(c) && u32::from(inner[c]) * 10 >= u32::from(widest) * 8 {
            sum += grid.points[c].coords;
            n += 1.0;
        }
    }
    let torso = P3::from(sum / n.max(1.0));
    let right = up.cross(&Vector3::z()).try_normalize(0.0)?;
    let height = |p: &P3| up.dot(&p.coords);
    let points = || {
        seen.cells
            .iter()
            .map(|&c| c as usize)
            .filter(|&c| usable(c))
            .map(|c| grid.points[c])
    };
    let crown = points()
        .filter(|p| right.dot(&(p - torso)).abs() < HEAD_BESIDE)
        .max_by(|a, b| height(a).total_cmp(&height(b)))?;
    let lowest = points().map(|p| height(&p)).fold(f32::INFINITY, f32::min);
    let seen_height = f64::from(height(&crown) - lowest) + SOLES;
    let over_floor = floor
        .map(|f| f64::from(height(&crown)) + f)
        .filter(|h| *h > seen_height - AFLOAT);
    let stature = over_floor.or((!cut_below).then_some(seen_height));
    Some(Outline {
        torso,
        crown,
        stature,
    })
}

/// Rotation of an upright body that faces the camera, turned by `yaw` about the vertical.
fn upright(up: &Vector3<f64>, yaw: f64) -> UnitQuaternion<f64> {
    let back = Vector3::z();
    // The body's z points at the camera: camera −z, made level.
    let z = (-(back - up * up.dot(&back)))
        .try_normalize(f64::EPSILON)
        .unwrap_or_else(|| -Vector3::z());
    let x = up.cross(&z);
    let m = Matrix3::from_columns(&[x, *up, z]);
    let facing = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(m));
    facing * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), yaw)
}

/// Finds the first pose. Returns the pose and its fit, or `None` when the outline says nothing.
pub(super) fn place(
    model: &TrackerModel,
    rest: (&RestBody, &SampleRest),
    seen: &Seen<'_>,
    outline: &Outline,
    up: &Vector3<f64>,
    scratch: &mut AlignScratch,
) -> Option<(Pose, Fit)> {
    let skeleton = model.template.skeleton();
    let crown = skeleton
        .index("head_end")
        .or_else(|| skeleton.index("head"))
        .unwrap_or(0);
    // A lean seen in the principal axes: only a clear one counts, as arms and a cut body bend the axes too.
    let mut best: Vec<(f64, Pose)> = Vec::new();
    for lean in leans(seen, up, outline) {
        for yaw in YAWS {
            let rotation = upright(&lean, yaw);
            // The crown fixes the height, the torso the place across, its front the depth.
            let at = |j: usize| rest.0.joints[j].coords;
            let chest = skeleton.index("spine3").unwrap_or(0);
            let away = outline
                .torso
                .coords
                .cast::<f64>()
                .try_normalize(0.0)
                .unwrap_or_else(Vector3::z);
            let torso = outline.torso.coords.cast::<f64>() + away * HALF_DEPTH;
            let mut t = torso - rotation * at(chest);
            let placed = rotation * at(crown) + t;
            t += lean * (outline.crown.coords.cast::<f64>() - placed).dot(&lean);
            let mut pose = Pose::rest(skeleton, Rigid::from_parts(t, rotation));
            let rough = Schedule {
                iterations: 3,
                ..START
            };
            align(model, rest, &mut pose, seen, &rough, scratch);
            let cost = evaluate(model, rest, &pose, seen, 0.15, scratch).cost;
            best.push((cost, pose));
        }
    }
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ends = ends(seen, &outline.torso);
    // Arms of the best torsos, one side after the other; outlines say little about hypotheses and cost the most.
    let terms = scratch.terms;
    scratch.terms.edge_weight = 0.0;
    for (cost, pose) in best.iter_mut().take(TORSO_FINALISTS) {
        for side in 0..2 {
            *pose = choose_arm(model, rest, pose, seen, side, &ends, scratch);
        }
        for side in 0..2 {
            *pose = choose_leg(model, rest, pose, seen, side, &ends, scratch);
        }
        *cost = evaluate(model, rest, pose, seen, 0.15, scratch).cost;
    }
    scratch.terms = terms;
    best.truncate(TORSO_FINALISTS);
    let mut winner: Option<(Pose, Fit)> = None;
    for (_, mut pose) in best {
        align(model, rest, &mut pose, seen, &START, scratch);
        let fit = evaluate(model, rest, &pose, seen, 0.10, scratch);
        if winner.as_ref().is_none_or(|(_, w)| fit.cost < w.cost) {
            winner = Some((pose, fit));
        }
    }
    winner
}

/// Upright directions to try: gravity's, and the long principal axis when the whole body is seen leaning.
fn leans(seen: &Seen<'_>, up: &Vector3<f64>, outline: &Outline) -> Vec<Vector3<f64>> {
    let mut out = vec![*up];
    let points: Vec<P3> = seen
        .cells
        .iter()
        .map(|&c| c as usize)
        .filter(|&c| seen.grid.depth[c] > 0.0)
        .map(|c| seen.grid.points[c])
        .collect();
    if let (Some(_), Some((_, axes, variance))) = (outline.stature, principal_axes(&points)) {
        let axis = axes.column(0).into_owned();
        let axis = if axis.dot(up) < 0.0 { -axis } else { axis };
        // Long and clearly tilted (15° to 60°).
        if variance[0] > 4.0 * variance[1] && (0.5..0.966).contains(&axis.dot(up)) {
            out.push(axis);
        }
    }
    out
}
