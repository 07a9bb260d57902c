//! Memory of candidates that turned out to be nobody: each waits longer before it is tried again, unless it changes, and
//! what spoke against it still does.

use serde::{Deserialize, Serialize};
use tryon_geometry::math::{P3, V3};

/// Place and size of a component.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CandidateBox {
    /// Mean of its points, camera frame, metres.
    pub centre: P3,
    /// Corners of its box, axes right, up and depth, metres.
    pub lo: P3,
    /// See `lo`.
    pub hi: P3,
}

/// A refused candidate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refusal {
    /// Candidate as last refused.
    pub candidate: CandidateBox,
    /// Refusals of it so far.
    pub count: u32,
    /// Frames until it is tried again.
    pub wait: u32,
    /// Log odds for a person after all trials.
    pub log_odds: f32,
}

/// Refused candidates of one scene, the latest last.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Refusals(Vec<Refusal>);

/// Displacement of a centre below which a candidate is the same thing, metres. Larger mistakes a person in motion for
/// what was refused; smaller forgets things whose outline flickers.
const SAME_CENTRE: f32 = 0.08;
/// The same for the corners of the box, where single cells flicker, metres. The lower side says nothing: thin poles and
/// shins come and go near the floor.
const SAME_CORNER: f32 = 0.25;
/// See [`SAME_CORNER`].
const ABOVE: V3 = V3::new(1.0, 0.0, 1.0);
/// Refusals without a wait: a second start may succeed where noise spoilt the first.
const FREE_TRIALS: u32 = 2;
/// Longest wait, frames: 2 s.
const LONGEST: u32 = 64;
/// Most refusals kept; the oldest is forgotten.
const MOST: usize = 32;

impl CandidateBox {
    /// True for the same thing seen again.
    fn is_same(&self, other: &Self) -> bool {
        (self.centre - other.centre).norm() < SAME_CENTRE
            && (self.lo - other.lo).component_mul(&ABOVE).amax() < SAME_CORNER
            && (self.hi - other.hi).amax() < SAME_CORNER
    }
}

impl Refusals {
    /// The refusal of a candidate.
    pub fn of(&self, candidate: &CandidateBox) -> Option<&Refusal> {
        self.0.iter().find(|r| r.candidate.is_same(candidate))
    }

    /// Log odds for a person of a candidate after its refusals; 0 without any.
    pub fn log_odds(&self, candidate: &CandidateBox) -> f32 {
        self.of(candidate).map_or(0.0, |r| r.log_odds)
    }

    /// Counts a frame of waiting.
    pub fn age(&mut self) {
        for r in &mut self.0 {
            r.wait = r.wait.saturating_sub(1);
        }
    }

    /// Records a refusal; the wait doubles with each one of the same candidate.
    pub fn record(&mut self, candidate: CandidateBox, log_odds: f32) {
        let count = self.forget(&candidate).saturating_add(1);
        let doubled = 1u32
            .checked_shl(count.saturating_sub(FREE_TRIALS))
            .unwrap_or(LONGEST);
        let wait = if count > FREE_TRIALS {
            doubled.min(LONGEST)
        } else {
            0
        };
        if self.0.len() >= MOST {
            self.0.remove(0);
        }
        self.0.push(Refusal {
            candidate,
            count,
            wait,
            log_odds,
        });
    }

    /// Forgets the refusal of a candidate; returns how often it was refused.
    pub fn forget(&mut self, candidate: &CandidateBox) -> u32 {
        let place = self.0.iter().position(|r| r.candidate.is_same(candidate));
        place.map_or(0, |i| self.0.remove(i).count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(x: f32, height: f32) -> CandidateBox {
        CandidateBox {
            centre: P3::new(x, 0.0, 2.0),
            lo: P3::new(x - 0.2, -1.0, 1.9),
            hi: P3::new(x + 0.2, height - 1.0, 2.1),
        }
    }

    #[test]
    fn waits_of_a_thing_grow_and_a_changed_one_waits_for_nothing() {
        let mut refusals = Refusals::default();
        let mut waits = vec![];
        for _ in 0..10 {
            refusals.record(candidate(0.0, 1.7), -1.0);
            waits.extend(refusals.of(&candidate(0.01, 1.7)).map(|r| r.wait));
        }
        assert_eq!(waits, [0, 0, 2, 4, 8, 16, 32, 64, 64, 64]);
        refusals.age();
        assert_eq!(
            refusals.of(&candidate(0.0, 1.7)).map(|r| r.wait),
            Some(LONGEST - 1)
        );
        let mut footless = candidate(0.0, 1.7);
        footless.lo.y += 0.5;
        assert!(refusals.of(&footless).is_some());
        for other in [candidate(0.1, 1.7), candidate(0.0, 2.1)] {
            assert!(refusals.of(&other).is_none(), "moved, or an arm raised");
        }
        assert_eq!(refusals.forget(&candidate(0.0, 1.7)), 10);
        assert!(refusals.of(&candidate(0.0, 1.7)).is_none());
    }

    #[test]
    fn no_more_than_the_latest_refusals_are_kept() {
        let mut refusals = Refusals::default();
        for k in 0..2 * MOST {
            refusals.record(candidate(k as f32, 1.7), -1.0);
        }
        assert_eq!(refusals.0.len(), MOST);
        assert!(refusals.of(&candidate(0.0, 1.7)).is_none());
        assert!(
            refusals
                .of(&candidate(2.0 * MOST as f32 - 1.0, 1.7))
                .is_some()
        );
    }
}
