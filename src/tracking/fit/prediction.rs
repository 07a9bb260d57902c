//! Prediction: start of the pose fit by constant velocity, kept where it explains the frame at least as well as the last
//! pose.

use super::extrapolation::{extrapolate, motion};
use super::schedule::TRACK;
use super::scratch::{FitContext, FitScratch};
use super::solve::{FitReport, evaluate, limit};
use tryon_body::Pose;

/// Loss of explained readings, against the last fit, up to which a prediction needs no coarse iterations.
const AS_GOOD_EXPLAINED: f64 = 0.015;
/// Bound on the residual of such a prediction: factor on the last residual, and allowance, metres.
const AS_GOOD_RESIDUAL: [f64; 2] = [1.2, 0.3e-3];
/// Motion per frame above which coarse iterations are never skipped, metres.
const SLOW: f64 = 0.02;
/// Motion per frame below which nothing is extrapolated, metres: it is jitter of the fit, which prediction would sustain.
pub(crate) const AT_REST: f64 = 3e-3;
/// Longest extrapolation, in intervals between frames.
const LONGEST: f64 = 3.0;
/// Damping of the extrapolated motion; a limb that stops overshoots less than with 1.
const DAMPING: f64 = 0.9;

/// Start of a fit.
pub(crate) struct Prediction {
    pub pose: Pose,
    /// True when the coarse iterations can be skipped.
    pub is_fine: bool,
}

/// The last poses and the fit of the last one.
pub(crate) struct RecentPoses<'a> {
    pub last: &'a Pose,
    /// Pose before the last one, if it is of the same track.
    pub before: Option<&'a Pose>,
    /// Capture time of the last pose.
    pub time_ns: u64,
    /// Time between both poses.
    pub interval_ns: u64,
    /// Fit of the last pose: share of explained readings, residual in metres.
    pub quality: [f64; 2],
    /// Size and shape no longer change.
    pub is_calibrated: bool,
}

/// Predicts the pose at `time_ns`.
pub(crate) fn predict(
    context: &FitContext<'_>,
    recent: &RecentPoses<'_>,
    time_ns: u64,
    scratch: &mut FitScratch,
) -> Prediction {
    let config = &context.model.config;
    let skeleton = context.model.template.skeleton();
    let pose = recent.last;
    let mut fit = |pose: &Pose| evaluate(context, pose, TRACK.distance[0], scratch);
    let [explained, residual] = recent.quality;
    let is_as_good = |fit: &FitReport| {
        config.skip_coarse
            && recent.is_calibrated
            && fit.explained > explained - AS_GOOD_EXPLAINED
            && fit.residual < AS_GOOD_RESIDUAL[0] * residual + AS_GOOD_RESIDUAL[1]
    };
    let before = recent
        .before
        .filter(|_| config.predict && recent.interval_ns > 0)
        .filter(|before| motion(skeleton, before, pose) > AT_REST);
    let Some(before) = before else {
        let is_fine = config.skip_coarse && is_as_good(&fit(pose));
        let pose = pose.clone();
        return Prediction { pose, is_fine };
    };
    let ahead = time_ns.saturating_sub(recent.time_ns) as f64 / recent.interval_ns as f64;
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
