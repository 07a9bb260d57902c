//! Pose fit (eq. 12): correspondences, normal equations of all residuals, damped Gauss–Newton until nothing moves.

mod equations;
mod schedule;
mod scratch;
mod solve;

#[cfg(test)]
pub(super) use equations::FloorLegs;
pub(super) use equations::{assemble, for_each_point, pair};
pub(super) use schedule::{
    ANNEAL, FitTerms, HYPOTHESIS_TERMS, START, START_TERMS, Schedule, TRACK,
};
pub(super) use scratch::{FitContext, FitScratch};
pub(super) use solve::{FitReport, evaluate, fit_pose, limit};
