//! Memory of candidates that turned out to be nobody: each waits longer before it is tried again, unless it changes, and
//! what spoke against it still does.

use crate::settings::RefusalSettings;
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

/// Axes of the lower corner that are compared: its side says nothing, thin poles and shins come and go near the floor.
const ABOVE: V3 = V3::new(1.0, 0.0, 1.0);

impl CandidateBox {
    /// True for the same thing seen again.
    fn is_same(&self, other: &Self, settings: &RefusalSettings) -> bool {
        (self.centre - other.centre).norm() < settings.same_centre
            && (self.lo - other.lo).component_mul(&ABOVE).amax() < settings.same_corner
            && (self.hi - other.hi).amax() < settings.same_corner
    }
}

impl Refusals {
    /// The refusal of a candidate.
    pub fn of(&self, candidate: &CandidateBox, settings: &RefusalSettings) -> Option<&Refusal> {
        self.0
            .iter()
            .find(|r| r.candidate.is_same(candidate, settings))
    }

    /// Log odds for a person of a candidate after its refusals; 0 without any.
    pub fn log_odds(&self, candidate: &CandidateBox, settings: &RefusalSettings) -> f32 {
        self.of(candidate, settings).map_or(0.0, |r| r.log_odds)
    }

    /// Counts a frame of waiting.
    pub fn age(&mut self) {
        for r in &mut self.0 {
            r.wait = r.wait.saturating_sub(1);
        }
    }

    /// Records a refusal; the wait doubles with each one of the same candidate.
    pub fn record(&mut self, candidate: CandidateBox, log_odds: f32, settings: &RefusalSettings) {
        let count = self.forget(&candidate, settings).saturating_add(1);
        let doubled = 1u32
            .checked_shl(count.saturating_sub(settings.free_trials))
            .unwrap_or(settings.longest);
        let wait = if count > settings.free_trials {
            doubled.min(settings.longest)
        } else {
            0
        };
        if self.0.len() >= settings.most {
            self.0.remove(0);
        }
        self.0.push(Refusal {
            candidate,
            count,
            wait,
            log_odds,
        });
    }

    /// Lets a candidate wait for this frame, whatever it was refused for.
    pub fn hold(&mut self, candidate: CandidateBox, settings: &RefusalSettings) {
        if self.of(&candidate, settings).is_none() {
            self.record(candidate, 0.0, settings);
        }
        let own = |r: &&mut Refusal| r.candidate.is_same(&candidate, settings);
        if let Some(refusal) = self.0.iter_mut().find(own) {
            refusal.wait = refusal.wait.max(1);
        }
    }

    /// Forgets the refusal of a candidate; returns how often it was refused.
    pub fn forget(&mut self, candidate: &CandidateBox, settings: &RefusalSettings) -> u32 {
        let place = self
            .0
            .iter()
            .position(|r| r.candidate.is_same(candidate, settings));
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
        let (mut refusals, settings) = (Refusals::default(), RefusalSettings::default());
        let mut waits = vec![];
        for _ in 0..10 {
            refusals.record(candidate(0.0, 1.7), -1.0, &settings);
            waits.extend(
                refusals
                    .of(&candidate(0.01, 1.7), &settings)
                    .map(|r| r.wait),
            );
        }
        assert_eq!(waits, [0, 0, 2, 4, 8, 16, 32, 64, 64, 64]);
        refusals.age();
        assert_eq!(
            refusals.of(&candidate(0.0, 1.7), &settings).map(|r| r.wait),
            Some(settings.longest - 1)
        );
        let mut footless = candidate(0.0, 1.7);
        footless.lo.y += 0.5;
        assert!(refusals.of(&footless, &settings).is_some());
        for other in [candidate(0.1, 1.7), candidate(0.0, 2.1)] {
            assert!(
                refusals.of(&other, &settings).is_none(),
                "moved, or an arm raised"
            );
        }
        assert_eq!(refusals.forget(&candidate(0.0, 1.7), &settings), 10);
        assert!(refusals.of(&candidate(0.0, 1.7), &settings).is_none());
    }

    #[test]
    fn no_more_than_the_latest_refusals_are_kept() {
        let (mut refusals, settings) = (Refusals::default(), RefusalSettings::default());
        for k in 0..2 * settings.most {
            refusals.record(candidate(k as f32, 1.7), -1.0, &settings);
        }
        assert_eq!(refusals.0.len(), settings.most);
        assert!(refusals.of(&candidate(0.0, 1.7), &settings).is_none());
        assert!(
            refusals
                .of(&candidate(2.0 * settings.most as f32 - 1.0, 1.7), &settings)
                .is_some()
        );
    }
}
