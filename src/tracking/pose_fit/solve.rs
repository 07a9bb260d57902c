//! Damped Gauss–Newton iterations of the pose, and the cost by which poses of one frame compare.

use super::equations::{PoseSums, UNEXPLAINED, assemble, for_each_point, pair};
use super::schedule::{ANNEAL, Schedule};
use super::scratch::{FitContext, FitScratch};
use crate::body::Pose;
use crate::registration::PairingStats;
use crate::tracking::TrackerModel;
use crate::tracking::kinematics::{LEVER, apply};

/// Width of the kernel in comparisons of poses, metres.
const COMPARED_SIGMA: f64 = 0.05;

/// Result of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::tracking) struct FitReport {
    pub iterations: usize,
    pub converged: bool,
    /// Mean distance of pairs along the normal, metres, weighted by the kernel.
    pub residual: f64,
    /// Robust cost per point, m²; comparable between poses of one frame.
    pub cost: f64,
    /// Share of readings that the model explains, 0 to 1.
    pub explained: f64,
    /// Share of visible model points that found a reading, 0 to 1.
    pub matched: f64,
    pub pairs: PairingStats,
}

impl FitReport {
    fn new(pairs: PairingStats, sums: PoseSums, iterations: usize) -> Self {
        let judged = pairs.visible - pairs.unknown;
        let missing = (pairs.readings - pairs.explained) + (judged - pairs.from_model);
        let all = (pairs.readings + judged).max(1) as f64;
        Self {
            iterations,
            converged: false,
            residual: if sums.weight > 0.0 {
                sums.distance / sums.weight
            } else {
                0.0
            },
            cost: (sums.cost + missing as f64 * UNEXPLAINED * UNEXPLAINED) / all,
            explained: pairs.explained as f64 / pairs.readings.max(1) as f64,
            matched: pairs.from_model as f64 / judged.max(1) as f64,
            pairs,
        }
    }
}

/// Evaluates a pose as it is, with pairs up to `distance` metres.
pub(in crate::tracking) fn evaluate(
    context: &FitContext<'_>,
    pose: &Pose,
    distance: f32,
    scratch: &mut FitScratch,
) -> FitReport {
    let stats = pair(context, pose, distance, 0.0, scratch);
    let point_to_point = context.model.config.point_to_point;
    let sums = for_each_point(context, scratch, COMPARED_SIGMA, point_to_point, |_| {});
    FitReport::new(stats, sums, 0)
}

/// Fits `pose` to the readings: Gauss–Newton with damping, joint limits and a weak pull to the rest pose.
pub(in crate::tracking) fn fit_pose(
    context: &FitContext<'_>,
    pose: &mut Pose,
    schedule: &Schedule,
    scratch: &mut FitScratch,
) -> FitReport {
    let model = context.model;
    let mut report = FitReport::default();
    for iteration in 0..schedule.iterations {
        let t = ((iteration + schedule.ahead) as f64 / ANNEAL as f64).min(1.0);
        let sigma = schedule.sigma[0] + (schedule.sigma[1] - schedule.sigma[0]) * t;
        let distance =
            schedule.distance[0] + (schedule.distance[1] - schedule.distance[0]) * t as f32;
        let pull = if t < 1.0 { schedule.pull } else { 0.0 };
        let stats = pair(context, pose, distance, pull, scratch);
        let sums = assemble(context, pose, sigma, model.config.point_to_point, scratch);
        report = FitReport::new(stats, sums, iteration + 1);
        if sums.weight < 1.0 {
            break;
        }
        let damping = vec![model.config.damping; scratch.dofs.len()];
        let Some(x) = scratch.equations.solve_damped(&damping) else {
            break;
        };
        apply(model.template.skeleton(), pose, &scratch.centre(), &x);
        limit(model, pose);
        let step = x
            .iter()
            .enumerate()
            .map(|(k, v)| if k < 3 { v.abs() } else { v.abs() * LEVER })
            .fold(0.0, f64::max);
        if t >= 1.0 && step < model.config.converged {
            report.converged = true;
            break;
        }
    }
    report
}

/// Clamps joints to their limits, where those are configured.
pub(in crate::tracking) fn limit(model: &TrackerModel, pose: &mut Pose) {
    if model.config.joint_limits {
        pose.clamp_to_limits(model.template.skeleton());
    }
}
