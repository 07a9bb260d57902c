//! Pose fit (eq. 12): correspondences, normal equations of all residuals, damped Gauss–Newton until nothing moves; before
//! it the prediction, after it the filter.

mod equations;
pub(crate) mod extrapolation;
pub(crate) mod hand_assignment;
pub(crate) mod pose_filter;
pub(crate) mod prediction;
mod scratch;
pub(crate) mod solve;
pub(crate) mod standing;
pub(crate) mod terms;

pub(crate) use equations::{assemble, for_each_point, pair};
pub(crate) use extrapolation::motion;
pub(crate) use hand_assignment::assign_hands;
pub(crate) use pose_filter::PoseFilter;
pub(crate) use prediction::{Prediction, RecentPoses, predict};
pub(crate) use scratch::{FitContext, FitScratch};
pub(crate) use solve::{FitReport, evaluate, fit_pose};
pub(crate) use standing::{FloorStance, FootMemory, HiddenKnees, floor_below, highest_hips};
pub(crate) use terms::FitTerms;
