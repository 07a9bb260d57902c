//! Repair of a pose that disagrees with its frame: limbs, then whole bodies, are tried where the part forest proposes them.

use crate::assess::{Agreement, AgreementScratch};
use crate::fit::{
    ANNEAL, FitContext, FitReport, FitScratch, HYPOTHESIS_TERMS, Schedule, TRACK, evaluate,
    fit_pose,
};
use crate::start::{BodyProposals, resting_limb};
use serde::{Deserialize, Serialize};
use tryon_body::Pose;
use tryon_body::parts::BodyPart;

/// Timer of the repairs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RepairTimer {
    /// Frames until the next repair.
    wait: u32,
    /// Frames to wait after it.
    interval: u32,
    /// Share of the area that was wrong after the last one.
    wrong: f32,
    /// Frames since the last check of the proposals.
    unchecked: u32,
    /// Frames in a row with a part in the air.
    #[serde(default)]
    in_air: u32,
}

/// Interval between checks of a pose that agrees, frames: a check costs 2 ms, half a step.
const CHECKED: u32 = 8;
/// Wrong share of the area above which a repair is tried. Good tracks have 0.01 to 0.13 (decision 043); half of the frames
/// of a good upper body pass 0.06.
const WRONG: f32 = 0.08;
/// Wrong share of the area above which the whole body is tried, not limbs alone; it costs three times as much.
const BODY_WRONG: f32 = 0.12;
/// Share of a part in free space above which one is tried; the forearms of a good upper body reach 0.39.
const PART_WRONG: f32 = 0.4;
/// Shortest and longest wait after a repair without success, frames: loose clothes never agree.
const WAIT: [u32; 2] = [1, 120];
/// Factor on the wrong share from which there is no waiting.
const WORSE: f32 = 1.5;
/// Factor on the cost that a better pose undercuts.
const CHEAPER: f64 = 0.95;
/// Frames after which a limb in the air rests unseen: fast ones lag by three (jacks).
const STUCK: u32 = 4;
/// Share of a part in free space above which it is then tried there.
const PART_IN_AIR: f32 = 0.15;
/// Factor on the cost that such a pose keeps below: what is unseen has no cost.
const NO_DEARER: f64 = 1.05;
/// Factor on the wrong share that a better pose undercuts: cost alone takes a fast arm for a bent one.
const AGREES: f32 = 0.7;
/// Longest pair in comparisons, metres.
const REACH: f32 = 0.10;
/// One iteration that leaves pairs and equations of the pose in the scratch.
const SETTLE: Schedule = Schedule {
    iterations: 1,
    ahead: ANNEAL,
    ..TRACK
};

impl RepairTimer {
    /// Records a frame's agreement; true when a repair is due.
    pub(crate) fn is_due(&mut self, agreement: &Agreement) -> bool {
        self.wait = self.wait.saturating_sub(1);
        let wrong = agreement.wrong();
        let is_in_air = agreement.parts.iter().any(|p| *p > PART_WRONG);
        self.in_air = if is_in_air { self.in_air + 1 } else { 0 };
        if wrong <= WRONG && !is_in_air {
            self.interval = self.interval.saturating_sub(1);
            self.wrong *= f32::from(u8::from(self.interval > 0));
            return false;
        }
        self.wait == 0 || wrong > WORSE * self.wrong || self.in_air == STUCK
    }

    /// True once a limb has been in the air for longer than a fast one is behind its readings.
    pub(crate) fn is_stuck(&self) -> bool {
        self.in_air >= STUCK
    }

    /// True a few times a second: an arm inside the torso disagrees with nothing, only with its proposals.
    pub(crate) fn is_check_due(&mut self) -> bool {
        self.unchecked = (self.unchecked + 1) % CHECKED;
        self.unchecked == 0
    }

    /// Records the result of a repair.
    pub(crate) fn record(&mut self, found: bool, wrong: f32) {
        self.interval = if found {
            0
        } else {
            (2 * self.interval).clamp(WAIT[0], WAIT[1])
        };
        (self.wait, self.wrong) = (self.interval, wrong);
    }
}

/// One disagreeing pose with the proposals of its frame.
pub(crate) struct Repair<'a> {
    pub context: FitContext<'a>,
    pub proposals: &'a BodyProposals,
    pub pose: &'a Pose,
    pub agreement: Agreement,
    /// A hand or foot is far from where it is proposed: the new pose need not agree better than this one.
    pub is_contradicted: bool,
    /// A limb has been in the air for a while: unless it is found, it rests unseen.
    pub is_stuck: bool,
}

/// A better pose.
pub(crate) struct RepairedPose {
    pub pose: Pose,
    pub fit: FitReport,
    pub agreement: Agreement,
}

impl Repair<'_> {
    /// The pose with limbs, or the body, where they are proposed and fitted, if that costs less and agrees better.
    pub(crate) fn search(
        &self,
        scratch: &mut FitScratch,
        measure: &mut AgreementScratch,
    ) -> Option<RepairedPose> {
        let cost = self.cost(self.pose, scratch);
        if self.is_stuck
            && let Some(pose) = self.out_of_the_air(scratch)
        {
            let kept = self.fitted(pose, (NO_DEARER * cost, AGREES), scratch, measure);
            if kept.is_some() {
                return kept;
            }
        }
        let candidates = scratch
            .with_terms(HYPOTHESIS_TERMS, |s| self.candidates(s))
            .into_iter();
        let rated = candidates.map(|pose| (self.cost(&pose, scratch), pose));
        let (_, pose) = rated.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let share = if self.is_contradicted { 1.0 } else { AGREES };
        self.fitted(pose, (CHEAPER * cost, share), scratch, measure)
    }

    /// A pose after a fit, if it costs at most `most` and has at most `share` of the wrong area of the present one.
    fn fitted(
        &self,
        mut pose: Pose,
        (most, share): (f64, f32),
        scratch: &mut FitScratch,
        measure: &mut AgreementScratch,
    ) -> Option<RepairedPose> {
        fit_pose(&self.context, &mut pose, &TRACK, scratch);
        if self.cost(&pose, scratch) > most || !pose.is_finite() {
            return None;
        }
        let agreement = measure.measure(&self.context, &pose, scratch);
        if agreement.wrong() > share * self.agreement.wrong() {
            return None;
        }
        let fit = fit_pose(&self.context, &mut pose, &SETTLE, scratch);
        Some(RepairedPose {
            pose,
            fit,
            agreement,
        })
    }

    /// Cost of a pose with its priors on facing and turn.
    fn cost(&self, pose: &Pose, scratch: &mut FitScratch) -> f64 {
        let fit = evaluate(&self.context, pose, REACH, scratch);
        let recent = self.pose.root.iso().rotation;
        fit.cost * self.proposals.prior_cost(pose, Some(recent))
    }

    /// The pose with each limb in the air where it may rest unseen; `None` without such a limb.
    fn out_of_the_air(&self, scratch: &mut FitScratch) -> Option<Pose> {
        let parts = BodyPart::ALL.into_iter().zip(self.agreement.parts);
        let in_air = parts.filter(|(_, free)| *free > PART_IN_AIR);
        in_air.fold(None, |best, (part, _)| {
            let pose = best.as_ref().unwrap_or(self.pose);
            resting_limb(&self.context, pose, part, &mut scratch.bones).or(best)
        })
    }

    fn candidates(&self, scratch: &mut FitScratch) -> Vec<Pose> {
        let limbs = self.proposals.limbs_of(&self.context, self.pose, scratch);
        let mut out: Vec<Pose> = limbs.into_iter().collect();
        if self.agreement.wrong() > BODY_WRONG || self.proposals.faces_away(self.pose) {
            out.extend(self.proposals.poses(&self.context, scratch));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repairs_follow_disagreement_at_growing_intervals() {
        let agreement = |in_free_space| Agreement {
            in_free_space,
            ..Agreement::default()
        };
        let mut timer = RepairTimer::default();
        assert!((0..100).all(|_| !timer.is_due(&agreement(0.03))), "good");
        let mut due = vec![];
        for frame in 0..20 {
            if timer.is_due(&agreement(0.1)) {
                due.push(frame);
                timer.record(false, 0.1);
            }
        }
        assert_eq!(due, [0, 1, 3, 7, 15]);
        assert!(timer.is_due(&agreement(0.2)), "worse than after the last");
        timer.record(false, 0.2);
        let good = (0..200).map(|_| timer.is_due(&agreement(0.0)));
        assert_eq!(good.filter(|due| *due).count(), 0);
        let part = Agreement {
            parts: [0.0, 0.5, 0.0, 0.0, 0.0],
            ..agreement(0.01)
        };
        assert!(!timer.is_due(&agreement(0.0)));
        assert!(timer.is_due(&part), "a limb in the air after a good frame");
    }
}
