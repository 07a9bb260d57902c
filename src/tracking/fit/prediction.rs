//! Prediction: start of the pose fit by constant velocity, kept where it explains the frame at least as well as the last
//! pose.

use super::extrapolation::{extrapolate, motion};
use super::scratch::{FitContext, FitScratch};
use super::solve::{FitReport, evaluate};
use tryon_body::Pose;

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
    let settings = &config.fit.prediction;
    let skeleton = context.model.template.skeleton();
    let pose = recent.last;
    let reach = config.fit.track.distance[0];
    let mut fit = |pose: &Pose| evaluate(context, pose, reach, scratch);
    let [explained, residual] = recent.quality;
    let is_as_good = |fit: &FitReport| {
        config.skip_coarse
            && recent.is_calibrated
            && fit.explained > explained - settings.as_good_explained
            && fit.residual < settings.as_good_residual[0] * residual + settings.as_good_residual[1]
    };
    let before = recent
        .before
        .filter(|_| settings.longest > 0.0 && recent.interval_ns > 0)
        .filter(|before| motion(skeleton, before, pose) > settings.at_rest);
    let Some(before) = before else {
        let is_fine = config.skip_coarse && is_as_good(&fit(pose));
        let pose = pose.clone();
        return Prediction { pose, is_fine };
    };
    let ahead = time_ns.saturating_sub(recent.time_ns) as f64 / recent.interval_ns as f64;
    let ratio = settings.damping * ahead.min(settings.longest);
    let mut moved = extrapolate(skeleton, before, pose, ratio);
    moved.clamp_to_limits(skeleton);
    let report = fit(&moved);
    let is_fine = motion(skeleton, pose, &moved) < settings.slow && is_as_good(&report);
    let pose = if is_fine || report.cost < fit(pose).cost {
        moved
    } else {
        pose.clone()
    };
    Prediction { pose, is_fine }
}
