//! Initial pose: the part network's proposals, and in doubt trunks by outline and principal axes with hypotheses of arms and
//! legs.

use super::body_proposals::{BodyProposals, about_body, upright};
use super::hypotheses::Hypotheses;
use crate::fit::{FitContext, FitReport, FitScratch, FitTerms, evaluate, fit_pose};
use crate::registration::Observation;
use crate::settings::{Schedule, StartSettings, TrackerConfig};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::PI;
use tryon_body::Pose;
use tryon_geometry::math::{P3, Rigid, principal_axes};
use tryon_geometry::spatial::chessboard_distances;

/// Landmarks of the subject's silhouette.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outline {
    /// Middle of the torso's front, camera frame, metres.
    pub torso: P3,
    /// Top of the head, camera frame, metres.
    pub crown: P3,
    /// Height from sole to crown, metres; `None` when cut off below, or short, without a known floor.
    pub stature: Option<f64>,
}

/// Points of the subject's cells that have a reading.
fn points<'a>(observation: &'a Observation<'_>) -> impl Iterator<Item = (usize, P3)> + 'a {
    let grid = observation.grid;
    let cells = observation.cells.iter().map(|&c| c as usize);
    cells
        .filter(|&c| grid.depth[c] > 0.0)
        .map(|c| (c, grid.points[c]))
}

/// Distance of each cell to the nearest cell outside the subject, cells. Cells beyond the image's rim count as outside,
/// except below: a torso cut by the lower rim continues.
fn silhouette_distance(observation: &Observation<'_>) -> Vec<u16> {
    let grid = observation.grid;
    let (columns, rows) = grid.size();
    let mut is_subject = vec![false; columns * rows];
    for &c in observation.cells {
        is_subject[c as usize] = true;
    }
    let beyond = |row: i32| if row >= rows as i32 { u16::MAX } else { 0 };
    let mut distance = Vec::new();
    chessboard_distances(grid, |k| !is_subject[k], beyond, &mut distance);
    distance
}

/// Middle of the readings farthest inside the silhouette, camera frame, metres.
fn torso(observation: &Observation<'_>, settings: &StartSettings) -> Option<P3> {
    let distance = silhouette_distance(observation);
    let widest = points(observation).map(|(c, _)| distance[c]).max()?;
    let (mut sum, mut n) = (Vector3::zeros(), 0.0f32);
    for (c, p) in points(observation) {
        if u32::from(distance[c]) * settings.torso_share[1]
            >= u32::from(widest) * settings.torso_share[0]
        {
            sum += p.coords;
            n += 1.0;
        }
    }
    Some(P3::from(sum / n.max(1.0)))
}

/// Measures torso, crown and stature. `up` is the unit direction against gravity, `floor` the camera's height over a known
/// floor, metres.
pub(crate) fn outline(
    observation: &Observation<'_>,
    up: &Vector3<f32>,
    cut_below: bool,
    floor: Option<f64>,
    config: &TrackerConfig,
) -> Option<Outline> {
    let settings = &config.start;
    let torso = torso(observation, settings)?;
    let right = up.cross(&Vector3::z()).try_normalize(0.0)?;
    let height = |p: &P3| up.dot(&p.coords);
    let crown = points(observation)
        .map(|(_, p)| p)
        .filter(|p| right.dot(&(p - torso)).abs() < settings.head_beside)
        .max_by(|a, b| height(a).total_cmp(&height(b)))?;
    let lowest = points(observation)
        .map(|(_, p)| height(&p))
        .fold(f32::INFINITY, f32::min);
    let visible_height = f64::from(height(&crown) - lowest) + settings.soles;
    let over_floor = floor
        .map(|f| f64::from(height(&crown)) + f)
        .filter(|h| *h > visible_height - settings.afloat);
    // Shorter, somebody not known to stand on a floor may lack the legs (black trousers).
    let is_whole = !cut_below && visible_height > config.shape.size.adults[0];
    let stature = over_floor.or(is_whole.then_some(visible_height));
    Some(Outline {
        torso,
        crown,
        stature,
    })
}

/// Rotation of an upright body that faces the camera, turned by `yaw` about the vertical.
fn facing_camera(up: &Vector3<f64>, yaw: f64) -> UnitQuaternion<f64> {
    upright(up, &-Vector3::z()) * about_body(yaw)
}

/// Knowledge of a start besides its readings.
pub(crate) struct StartPrior<'a> {
    /// Unit direction against gravity, camera frame.
    pub up: &'a Vector3<f64>,
    /// Root's rotation of a moment ago: nobody turns around between two frames, while front and back may cost the same.
    pub recent: Option<UnitQuaternion<f64>>,
    /// Proposals of the part network.
    pub proposals: &'a BodyProposals,
}

/// A fitted start and the cost by which starts compare.
struct FittedStart {
    cost: f64,
    pose: Pose,
    fit: FitReport,
}

/// Finds the initial pose and its fit: among the proposals, and by a search of its own where those are in doubt or fit
/// badly.
pub(crate) fn initial_pose(
    context: &FitContext<'_>,
    outline: &Outline,
    prior: &StartPrior<'_>,
    scratch: &mut FitScratch,
) -> Option<(Pose, FitReport)> {
    let settings = &context.model.config.start;
    let terms = FitTerms::hypothesis(&context.model.config.fit);
    let proposed = scratch.with_terms(terms, |s| prior.proposals.poses(context, s));
    let mut best = prior.best(context, proposed, scratch);
    if let Some(start) = &best {
        scratch.draw(context, &start.pose);
        let pulled = scratch.with_terms(terms, |s| prior.proposals.pulled(context, &start.pose, s));
        let other = prior.best(context, pulled.into_iter().collect(), scratch);
        best = cheaper(best, other);
    }
    let is_poor = |b: &FittedStart| b.fit.cost > settings.poor;
    if prior.proposals.is_doubtful() || best.as_ref().is_none_or(is_poor) {
        let proposed = best.as_ref().filter(|_| !prior.proposals.is_doubtful());
        let proposed = proposed.map(|b| b.pose.clone());
        let searched =
            scratch.with_terms(terms, |s| searched(context, outline, prior.up, proposed, s));
        let other = prior.best(context, searched, scratch);
        best = cheaper(best, other);
    }
    best.map(|b| (b.pose, b.fit))
}

/// The start of less cost.
fn cheaper(a: Option<FittedStart>, b: Option<FittedStart>) -> Option<FittedStart> {
    let starts = a.into_iter().chain(b);
    starts.min_by(|a, b| a.cost.total_cmp(&b.cost))
}

impl StartPrior<'_> {
    /// Fits all poses; the one of least cost.
    fn best(
        &self,
        context: &FitContext<'_>,
        poses: Vec<Pose>,
        scratch: &mut FitScratch,
    ) -> Option<FittedStart> {
        let settings = &context.model.config.start;
        let fitted = |mut pose: Pose| {
            fit_pose(context, &mut pose, &context.model.config.fit.start, scratch);
            let fit = evaluate(context, &pose, settings.reach[1], scratch);
            let dispute = self.proposals.dispute_cost(context.model, &pose, scratch);
            let cost = fit.cost * self.proposals.prior_cost(&pose, self.recent) * dispute;
            FittedStart { cost, pose, fit }
        };
        let fitted = poses.into_iter().map(fitted);
        fitted.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }
}

/// The best trunks of either facing and the proposed pose, with the arms and legs of least cost.
fn searched(
    context: &FitContext<'_>,
    outline: &Outline,
    up: &Vector3<f64>,
    proposed: Option<Pose>,
    scratch: &mut FitScratch,
) -> Vec<Pose> {
    let settings = &context.model.config.start;
    let mut best: Vec<(f64, Pose)> = proposed.map(|p| (0.0, p)).into_iter().collect();
    // Bodies that face the camera, and that face away.
    for (facing, finalists) in [0.0, PI].into_iter().zip(settings.finalists) {
        let mut trunks = trunks(context, outline, up, facing, scratch);
        trunks.sort_by(|a, b| a.0.total_cmp(&b.0));
        best.extend(trunks.into_iter().take(finalists));
    }
    let hypotheses = Hypotheses::new(context, &outline.torso);
    let with_limbs = |(_, mut pose): (f64, Pose)| {
        for side in 0..2 {
            pose = hypotheses.choose_arm(&pose, side, scratch);
        }
        for side in 0..2 {
            pose = hypotheses.choose_leg(&pose, side, scratch);
        }
        pose
    };
    best.into_iter().map(with_limbs).collect()
}

/// Rest poses at each lean and yaw about a facing after a short fit, with their costs.
fn trunks(
    context: &FitContext<'_>,
    outline: &Outline,
    up: &Vector3<f64>,
    facing: f64,
    scratch: &mut FitScratch,
) -> Vec<(f64, Pose)> {
    let settings = &context.model.config.start;
    let skeleton = context.model.template.skeleton();
    let schedule = Schedule {
        iterations: settings.trunk_iterations,
        ..context.model.config.fit.start
    };
    let mut out = Vec::new();
    for lean in leans(context.observation, up, outline, settings) {
        for yaw in settings.yaws {
            let root = trunk_root(context, outline, &lean, facing_camera(&lean, facing + yaw));
            let mut pose = Pose::rest(skeleton, root);
            fit_pose(context, &mut pose, &schedule, scratch);
            let cost = evaluate(context, &pose, settings.reach[0], scratch).cost;
            out.push((cost, pose));
        }
    }
    out
}

/// Root of a rest pose of the given rotation: the crown gives its height, the torso its place across, the torso's front
/// its depth.
fn trunk_root(
    context: &FitContext<'_>,
    outline: &Outline,
    lean: &Vector3<f64>,
    rotation: UnitQuaternion<f64>,
) -> Rigid<tryon_geometry::math::Camera, tryon_geometry::math::Body> {
    let settings = &context.model.config.start;
    let (crown, chest) = (context.model.crown, context.model.chest);
    let at = |j: usize| context.body.rest.joints[j].coords;
    let front = outline.torso.coords.cast::<f64>();
    let away = front.try_normalize(0.0).unwrap_or_else(Vector3::z);
    let mut t = front + away * settings.half_depth - rotation * at(chest);
    let placed = rotation * at(crown) + t;
    t += lean * (outline.crown.coords.cast::<f64>() - placed).dot(lean);
    Rigid::from_parts(t, rotation)
}

/// Upright directions to try: against gravity, and the long principal axis of a whole body that leans.
fn leans(
    observation: &Observation<'_>,
    up: &Vector3<f64>,
    outline: &Outline,
    settings: &StartSettings,
) -> Vec<Vector3<f64>> {
    let mut out = vec![*up];
    let points: Vec<P3> = points(observation).map(|(_, p)| p).collect();
    if let (Some(_), Some((_, axes, variance))) = (outline.stature, principal_axes(&points)) {
        let axis = axes.column(0).into_owned();
        let axis = if axis.dot(up) < 0.0 { -axis } else { axis };
        let [least, most] = settings.lean_range;
        let leans = (least..most).contains(&axis.dot(up));
        if leans && variance[0] > settings.elongation * variance[1] {
            out.push(axis);
        }
    }
    out
}
