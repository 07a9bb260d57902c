//! Pose fit (eq. 12): correspondences, normal equations of all residuals, damped Gauss–Newton until nothing moves; before
//! it the prediction, after it the filter.

mod equations;
pub(crate) mod extrapolation;
pub(crate) mod hand_assignment;
pub(crate) mod pose_filter;
pub(crate) mod prediction;
pub(crate) mod schedule;
mod scratch;
pub(crate) mod solve;
pub(crate) mod standing;

pub(crate) use equations::{assemble, for_each_point, pair};
pub(crate) use extrapolation::motion;
pub(crate) use hand_assignment::assign_hands;
pub(crate) use pose_filter::filter_pose;
pub(crate) use prediction::{AT_REST, Prediction, RecentPoses, predict};
pub(crate) use schedule::{
    ANNEAL, FitTerms, HYPOTHESIS_TERMS, START, START_TERMS, Schedule, TRACK,
};
pub(crate) use scratch::{FitContext, FitScratch};
pub(crate) use solve::{FitReport, evaluate, fit_pose};
pub(crate) use standing::{FloorStance, FootMemory, HiddenKnees, floor_below, highest_hips};
