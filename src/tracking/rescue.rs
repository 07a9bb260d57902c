//! An arm that went astray is looked for again: by the arm poses of a first placement, the rest of the body as it is.

use super::align::{AlignScratch, Fit, START_TERMS, SampleRest, Schedule, Seen, align, evaluate};
use super::hypotheses::{choose_arm, ends};
use super::model::TrackerModel;
use crate::body::{Pose, RestBody};
use serde::{Deserialize, Serialize};

/// When arms were looked for, and when they will be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Rescue {
    /// Frames in a row of which the body explains too little.
    poor: u32,
    /// Frames until the next look, and how long to wait after it.
    wait: u32,
    interval: u32,
    /// Looks so far; sides take turns.
    looks: u32,
}

/// A share of explained readings below this means that something is somewhere else: followed well, the shared sequences
/// have 0.95 and more, an arm astray leaves 0.88 to 0.94.
const POOR: f64 = 0.955;
/// So many such frames in a row before an arm is looked for; a fast arm catches up within two.
const PATIENCE: u32 = 3;
/// Frames between two looks, which cost as much as half a placement: the first wait, and the longest after looks that
/// found nothing (loose clothes are never explained).
const WAIT: [u32; 2] = [3, 240];
/// A found arm makes the cost smaller by this factor and explains this much more of the readings.
const CHEAPER: f64 = 0.95;
/// See [`CHEAPER`].
const EXPLAINS: f64 = 0.01;
/// Reach of the comparison, metres.
const REACH: f32 = 0.10;

impl Rescue {
    /// Takes note of a frame's fit; true when an arm should be looked for now.
    pub(super) fn due(&mut self, fit: &Fit) -> bool {
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

    /// Looks for one arm. Returns the better fit when there is one, with `pose` changed.
    pub(super) fn look(
        &mut self,
        model: &TrackerModel,
        rest: (&RestBody, &SampleRest),
        pose: &mut Pose,
        seen: &Seen<'_>,
        schedule: &Schedule,
        scratch: &mut AlignScratch,
    ) -> Option<Fit> {
        let side = (self.looks % 2) as usize;
        self.looks = self.looks.wrapping_add(1);
        let now = evaluate(model, rest, pose, seen, REACH, scratch);
        // The trunk's middle, as the pose has it.
        let chest = model.template.skeleton().index("spine3").unwrap_or(0);
        let torso = scratch.bones.joints[chest].cast::<f32>();
        let terms = scratch.terms;
        scratch.terms = super::align::Terms {
            edge_weight: 0.0,
            ..START_TERMS
        };
        let mut other = choose_arm(model, rest, pose, seen, side, &ends(seen, &torso), scratch);
        scratch.terms = terms;
        align(
            model,
            rest,
            &mut other,
            seen,
            &Schedule {
                ahead: 0,
                ..*schedule
            },
            scratch,
        );
        let fit = evaluate(model, rest, &other, seen, REACH, scratch);
        let found = fit.cost < CHEAPER * now.cost
            && fit.explained > now.explained + EXPLAINS
            && other.is_finite();
        // Both sides have had their turn before the wait grows.
        self.interval = match (found, self.looks.is_multiple_of(2)) {
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
    fn looks_come_when_needed_and_ever_more_rarely() {
        let fit = |explained| Fit {
            explained,
            ..Fit::default()
        };
        let mut r = Rescue::default();
        assert!(
            (0..100).all(|_| !r.due(&fit(0.98))),
            "a good fit needs no look"
        );
        assert!(
            !r.due(&fit(0.9)) && !r.due(&fit(0.9)) && r.due(&fit(0.9)),
            "at the third poor frame"
        );
        r.wait = 5;
        assert_eq!((0..10).filter(|_| r.due(&fit(0.9))).count(), 6);
        r.interval = 64;
        assert!(
            !r.due(&fit(1.0)) && r.interval == 0,
            "a good frame forgets the waiting"
        );
    }
}
