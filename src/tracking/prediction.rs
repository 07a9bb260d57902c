//! Prediction: start of the pose fit by constant velocity, kept where it explains the frame at least as well as the last
//! pose.

use super::TrackerState;
use super::extrapolation::{extrapolate, motion};
use super::pose_fit::{FitContext, FitReport, FitScratch, TRACK, evaluate, limit};
use tryon_body::Pose;

/// Loss of explained readings, against the last fit, up to which a prediction needs no coarse iterations.
const AS_GOOD_EXPLAINED: f64 = 0.015;
/// Bound on the residual of such a prediction: factor on the last residual, and allowance, metres.
const AS_GOOD_RESIDUAL: [f64; 2] = [1.2, 0.3e-3];
/// Motion per frame above which coarse iterations are never skipped, metres.
const SLOW: f64 = 0.02;
/// Motion per frame below which nothing is extrapolated, metres: it is jitter of the fit, which prediction would sustain.
pub(super) const AT_REST: f64 = 3e-3;
/// Longest extrapolation, in intervals between frames.
const LONGEST: f64 = 3.0;
/// Damping of the extrapolated motion; a limb that stops overshoots less than with 1.
const DAMPING: f64 = 0.9;

/// Start of a fit.
pub(super) struct Prediction {
    pub pose: Pose,
    /// True when the coarse iterations can be skipped.
    pub is_fine: bool,
}

/// Predicts the pose at `time_ns`.
pub(super) fn predict(
    context: &FitContext<'_>,
    state: &TrackerState,
    time_ns: u64,
    scratch: &mut FitScratch,
) -> Prediction {
    let config = &context.model.config;
    let skeleton = context.model.template.skeleton();
    let pose = &state.pose;
    let mut fit = |pose: &Pose| evaluate(context, pose, TRACK.distance[0], scratch);
    let [explained, residual] = state.quality;
    let is_as_good = |fit: &FitReport| {
        config.skip_coarse
            && state.calibrated(config)
            && fit.explained > explained - AS_GOOD_EXPLAINED
            && fit.residual < AS_GOOD_RESIDUAL[0] * residual + AS_GOOD_RESIDUAL[1]
    };
    let before = state
        .before
        .as_ref()
        .filter(|_| config.predict && state.interval_ns > 0)
        .filter(|before| motion(skeleton, before, pose) > AT_REST);
    let Some(before) = before else {
        let is_fine = config.skip_coarse && is_as_good(&fit(pose));
        let pose = pose.clone();
        return Prediction { pose, is_fine };
    };
    let ahead = time_ns.saturating_sub(state.time_ns) as f64 / state.interval_ns as f64;
    let mut moved = extrapolate(skeleton, before, pose, DAMPING * ahead.min(LONGEST));
    limit(context.model, &mut moved);
    let report = fit(&moved);
    let is_fine = motion(skeleton, pose, &moved) < SLOW && is_as_good(&report);
    let pose = if is_fine || report.cost < fit(pose).cost {
        moved
    } else {
        pose.clone()
    };
    Prediction { pose, is_fine }
}
