//! Limb recovery: an arm that lost its readings is searched with the hypotheses of an initial pose, the rest of the body
//! as it is.

use super::hypotheses::Hypotheses;
use super::pose_fit::{
    FitContext, FitReport, FitScratch, FitTerms, START_TERMS, Schedule, evaluate, fit_pose,
};
use crate::body::Pose;
use serde::{Deserialize, Serialize};

/// Timer of the searches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct LimbRecovery {
    /// Frames in a row with too few explained readings.
    poor: u32,
    /// Frames until the next search.
    wait: u32,
    /// Frames to wait after it.
    interval: u32,
    /// Searches so far; sides alternate.
    #[serde(rename = "looks")]
    searches: u32,
}

/// Share of explained readings below which a limb is elsewhere: good tracks have 0.95 and more, a lost arm 0.88 to 0.94.
const POOR: f64 = 0.955;
/// Poor frames in a row before a search; a fast arm catches up within two.
const PATIENCE: u32 = 3;
/// Shortest and longest wait between searches, frames. One costs half an initial pose, and loose clothes are never explained.
const WAIT: [u32; 2] = [3, 240];
/// Factor on the cost that a found arm undercuts.
const CHEAPER: f64 = 0.95;
/// Share of readings that a found arm explains in addition.
const EXPLAINS: f64 = 0.01;
/// Longest pair in the comparison, metres.
const REACH: f32 = 0.10;

impl LimbRecovery {
    /// Records a frame's fit; true when a search is due.
    pub(super) fn is_due(&mut self, fit: &FitReport) -> bool {
        self.wait = self.wait.saturating_sub(1);
        self.poor = if fit.explained < POOR {
            self.poor.saturating_add(1)
        } else {
            0
        };
        if self.poor == 0 && self.wait == 0 {
            self.interval = 0;
        }
        self.poor >= PATIENCE && self.wait == 0
    }

    /// Searches one arm. Returns the better fit when there is one, with `pose` changed.
    pub(super) fn search(
        &mut self,
        context: &FitContext<'_>,
        pose: &mut Pose,
        schedule: &Schedule,
        scratch: &mut FitScratch,
    ) -> Option<FitReport> {
        let side = (self.searches % 2) as usize;
        self.searches = self.searches.wrapping_add(1);
        let now = evaluate(context, pose, REACH, scratch);
        let torso = scratch.bones.joints[context.model.chest].cast::<f32>();
        let terms = scratch.terms;
        scratch.terms = FitTerms {
            edge_weight: 0.0,
            ..START_TERMS
        };
        let mut other = Hypotheses::new(context, &torso).choose_arm(pose, side, scratch);
        scratch.terms = terms;
        let schedule = Schedule {
            ahead: 0,
            ..*schedule
        };
        fit_pose(context, &mut other, &schedule, scratch);
        let fit = evaluate(context, &other, REACH, scratch);
        let found = fit.cost < CHEAPER * now.cost
            && fit.explained > now.explained + EXPLAINS
            && other.is_finite();
        // The wait grows after both sides had their turn.
        self.interval = match (found, self.searches.is_multiple_of(2)) {
            (true, _) => WAIT[0],
            (false, true) => (2 * self.interval).clamp(WAIT[0], WAIT[1]),
            (false, false) => self.interval,
        };
        self.wait = self.interval.max(1);
        if found {
            *pose = other;
        }
        found.then_some(fit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn searches_follow_poor_frames_at_growing_intervals() {
        let fit = |explained| FitReport {
            explained,
            ..FitReport::default()
        };
        let mut r = LimbRecovery::default();
        assert!((0..100).all(|_| !r.is_due(&fit(0.98))), "good fits");
        let due = [0; 3].map(|_| r.is_due(&fit(0.9)));
        assert_eq!(due, [false, false, true], "at the third poor frame");
        r.wait = 5;
        assert_eq!((0..10).filter(|_| r.is_due(&fit(0.9))).count(), 6);
        r.interval = 64;
        assert!(!r.is_due(&fit(1.0)) && r.interval == 0, "a good frame");
    }
}
