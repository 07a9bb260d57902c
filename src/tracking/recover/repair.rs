//! Repair of a pose that disagrees with its frame: limbs, then whole bodies, are tried where the part network proposes them.

use crate::assess::{Agreement, AgreementScratch};
use crate::fit::{FitContext, FitReport, FitScratch, FitTerms, evaluate, fit_pose};
use crate::settings::{RepairSettings, Schedule};
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
    /// Frames for which a hand that was detected still holds its arm, left and right.
    #[serde(default)]
    held: [u32; 2],
}

impl RepairTimer {
    /// Records the hands that a frame shows beyond sleeves without return.
    pub(crate) fn see_hands(&mut self, is_detected: [bool; 2], settings: &RepairSettings) {
        for (held, is_detected) in self.held.iter_mut().zip(is_detected) {
            *held = if is_detected {
                settings.hand_memory
            } else {
                held.saturating_sub(1)
            };
        }
    }

    /// Arms whose hand was detected a moment ago, left and right: their sleeves only seem to be in the air.
    pub(crate) fn is_held(&self) -> [bool; 2] {
        self.held.map(|frames| frames > 0)
    }

    /// Records a frame's agreement; true when a repair is due.
    pub(crate) fn is_due(&mut self, agreement: &Agreement, settings: &RepairSettings) -> bool {
        self.wait = self.wait.saturating_sub(1);
        let wrong = agreement.wrong();
        let is_in_air = agreement.parts.iter().any(|p| *p > settings.part_wrong);
        self.in_air = if is_in_air { self.in_air + 1 } else { 0 };
        if wrong <= settings.wrong && !is_in_air {
            self.interval = self.interval.saturating_sub(1);
            self.wrong *= f32::from(u8::from(self.interval > 0));
            return false;
        }
        self.wait == 0 || wrong > settings.worse * self.wrong || self.in_air == settings.stuck
    }

    /// True once a limb has been in the air for longer than a fast one is behind its readings.
    pub(crate) fn is_stuck(&self, settings: &RepairSettings) -> bool {
        self.in_air >= settings.stuck
    }

    /// True a few times a second: an arm inside the torso disagrees with nothing, only with its proposals.
    pub(crate) fn is_check_due(&mut self, settings: &RepairSettings) -> bool {
        self.unchecked = (self.unchecked + 1) % settings.checked;
        self.unchecked == 0
    }

    /// Records the result of a repair.
    pub(crate) fn record(&mut self, found: bool, wrong: f32, settings: &RepairSettings) {
        self.interval = if found {
            0
        } else {
            (2 * self.interval).clamp(settings.wait[0], settings.wait[1])
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
    /// Arms whose hand was detected a moment ago, left and right.
    pub is_held: [bool; 2],
}

/// Bound on the cost and on the wrong share of the area of a better pose.
#[derive(Clone, Copy)]
struct RepairBound {
    cost: f64,
    wrong: f32,
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
        let settings = &self.context.model.config.recover.repair;
        let cost = self.cost(self.pose, scratch);
        let bound = |dearer: f64, share: f32| RepairBound {
            cost: dearer * cost,
            wrong: share * self.agreement.wrong(),
        };
        if self.is_stuck
            && let Some(pose) = self.out_of_the_air(scratch)
        {
            let bound = bound(settings.no_dearer, settings.agrees);
            let kept = self.fitted(pose, bound, scratch, measure);
            if kept.is_some() {
                return kept;
            }
        }
        // A detected hand keeps its arm.
        let terms = FitTerms {
            hands: scratch.terms.hands,
            ..FitTerms::hypothesis(&self.context.model.config.fit)
        };
        let candidates = scratch
            .with_terms(terms, |s| self.candidates(s))
            .into_iter();
        let rated = candidates.map(|pose| (self.cost(&pose, scratch), pose));
        let (_, pose) = rated.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let share = (!self.is_contradicted).then_some(settings.agrees);
        let bound = bound(settings.cheaper, share.unwrap_or(1.0));
        self.fitted(pose, bound, scratch, measure)
    }

    /// A pose after a fit, if it stays within the bound.
    fn fitted(
        &self,
        mut pose: Pose,
        bound: RepairBound,
        scratch: &mut FitScratch,
        measure: &mut AgreementScratch,
    ) -> Option<RepairedPose> {
        let fit = &self.context.model.config.fit;
        fit_pose(&self.context, &mut pose, &fit.track, scratch);
        if self.cost(&pose, scratch) > bound.cost || !pose.is_finite() {
            return None;
        }
        let agreement = measure.measure(&self.context, &pose, scratch);
        if agreement.wrong() > bound.wrong {
            return None;
        }
        // One iteration leaves pairs and equations of the pose in the scratch.
        let settle = Schedule {
            iterations: 1,
            ahead: fit.anneal,
            ..fit.track
        };
        let fit = fit_pose(&self.context, &mut pose, &settle, scratch);
        Some(RepairedPose {
            pose,
            fit,
            agreement,
        })
    }

    /// Cost of a pose with its priors on facing and turn.
    fn cost(&self, pose: &Pose, scratch: &mut FitScratch) -> f64 {
        let settings = &self.context.model.config.recover.repair;
        let fit = evaluate(&self.context, pose, settings.reach, scratch);
        let recent = self.pose.root.iso().rotation;
        fit.cost * self.proposals.prior_cost(pose, Some(recent))
    }

    /// The pose with each limb in the air where it may rest unseen; `None` without such a limb.
    fn out_of_the_air(&self, scratch: &mut FitScratch) -> Option<Pose> {
        let settings = &self.context.model.config.recover.repair;
        let parts = BodyPart::ALL.into_iter().zip(self.agreement.parts);
        let [left, right] = self.is_held;
        let is_held = |part| match part {
            BodyPart::LeftArm => left,
            BodyPart::RightArm => right,
            _ => false,
        };
        let in_air = parts.filter(|(part, free)| *free > settings.part_in_air && !is_held(*part));
        in_air.fold(None, |best, (part, _)| {
            let pose = best.as_ref().unwrap_or(self.pose);
            resting_limb(&self.context, pose, part, &mut scratch.bones).or(best)
        })
    }

    fn candidates(&self, scratch: &mut FitScratch) -> Vec<Pose> {
        let settings = &self.context.model.config.recover.repair;
        let limbs = self.proposals.limbs_of(&self.context, self.pose, scratch);
        let mut out: Vec<Pose> = limbs.into_iter().collect();
        scratch.draw(&self.context, self.pose);
        out.extend(self.proposals.pulled(&self.context, self.pose, scratch));
        if self.agreement.wrong() > settings.body_wrong || self.proposals.faces_away(self.pose) {
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
        let (mut timer, settings) = (RepairTimer::default(), RepairSettings::default());
        assert!(
            (0..100).all(|_| !timer.is_due(&agreement(0.03), &settings)),
            "good"
        );
        let mut due = vec![];
        for frame in 0..20 {
            if timer.is_due(&agreement(0.1), &settings) {
                due.push(frame);
                timer.record(false, 0.1, &settings);
            }
        }
        assert_eq!(due, [0, 1, 3, 7, 15]);
        assert!(
            timer.is_due(&agreement(0.2), &settings),
            "worse than after the last"
        );
        timer.record(false, 0.2, &settings);
        let good = (0..200).map(|_| timer.is_due(&agreement(0.0), &settings));
        assert_eq!(good.filter(|due| *due).count(), 0);
        let part = Agreement {
            parts: [0.0, 0.5, 0.0, 0.0, 0.0],
            ..agreement(0.01)
        };
        assert!(!timer.is_due(&agreement(0.0), &settings));
        assert!(
            timer.is_due(&part, &settings),
            "a limb in the air after a good frame"
        );
    }
}
