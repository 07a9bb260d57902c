//! Test whether the subject faces as its pose does: front and back fit the readings nearly alike.

use crate::segment::part_network::{YAW_BINS, YawBelief};
use crate::settings::FacingSettings;
use serde::{Deserialize, Serialize};
use std::f32::consts::TAU;

/// Log odds that the subject faces as its pose does, against the opposite: a sum over frames that forgets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FacingBelief {
    log_odds: f32,
    is_decided: bool,
}

/// Outcome of the test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FacingVerdict {
    /// The pose may be turned around: it is followed, not live.
    Undecided,
    /// It faces as the subject does.
    Right,
    /// It is turned around.
    Reversed,
}

impl FacingBelief {
    /// Belief in a pose just found, before any evidence.
    pub(crate) const NEW: Self = Self {
        log_odds: 0.0,
        is_decided: false,
    };

    /// Belief in a pose of whose facing somebody else is sure.
    pub(crate) fn given(settings: &FacingSettings) -> Self {
        Self {
            log_odds: settings.most,
            is_decided: true,
        }
    }

    /// Adds a frame in which the pose has this yaw, radians, and moves `forward`, along its front, m/s. A body that lies has
    /// no yaw: nothing speaks for its facing, or against it.
    pub(crate) fn update(
        &mut self,
        yaw: Option<f64>,
        forward: f32,
        votes: &YawBelief,
        settings: &FacingSettings,
    ) {
        match yaw {
            Some(yaw) => {
                let seen = log_odds(yaw as f32, votes, settings);
                let walks = forward.abs() >= settings.walking;
                let walked = f32::from(u8::from(walks)) * settings.walk.copysign(forward);
                let odds = seen + walked;
                let sum = settings.kept * self.log_odds + odds;
                self.log_odds = sum.clamp(-settings.most, settings.most);
            }
            None => self.is_decided = true,
        }
        match self.verdict(settings) {
            FacingVerdict::Right => self.is_decided = true,
            FacingVerdict::Reversed => self.is_decided = false,
            FacingVerdict::Undecided => {}
        }
    }

    /// The pose was turned around.
    pub(crate) fn turn(&mut self) {
        self.log_odds = -self.log_odds;
        self.is_decided = true;
    }

    /// Nothing was found that faces the other way.
    pub(crate) fn doubt(&mut self) {
        *self = Self::NEW;
    }

    /// Outcome so far. Who was right once stays so until the evidence is for the opposite.
    pub(crate) fn verdict(&self, settings: &FacingSettings) -> FacingVerdict {
        if self.log_odds <= -settings.sure {
            FacingVerdict::Reversed
        } else if self.is_decided || self.log_odds >= settings.sure {
            FacingVerdict::Right
        } else {
            FacingVerdict::Undecided
        }
    }
}

/// Logarithm of the belief within a quarter turn of a yaw over the belief beyond; bins on the border count half.
fn log_odds(yaw: f32, votes: &YawBelief, settings: &FacingSettings) -> f32 {
    if votes.cells == 0 {
        return 0.0;
    }
    let eighth = TAU / YAW_BINS as f32;
    let share = |k: usize| {
        let cosine = (eighth * k as f32 - yaw).cos();
        // From 0 a half bin beyond the border to 1 a half bin before it.
        (0.5 + cosine / eighth).clamp(0.0, 1.0)
    };
    let within: f32 = (0..YAW_BINS).map(|k| votes.bins[k] * share(k)).sum();
    let [within, beyond] = [within, 1.0 - within].map(|p| p.max(settings.least));
    (within / beyond).ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn votes(bins: [f32; YAW_BINS]) -> YawBelief {
        YawBelief { bins, cells: 100 }
    }

    #[test]
    fn a_front_is_right_for_front_and_sides_and_reversed_for_a_back() {
        let settings = FacingSettings::default();
        let front = votes([0.94, 0.02, 0.01, 0.0, 0.0, 0.0, 0.01, 0.02]);
        let verdict = |yaw: f64| {
            let mut belief = FacingBelief::NEW;
            belief.update(Some(yaw), 0.0, &front, &settings);
            belief.verdict(&settings)
        };
        assert_eq!(verdict(0.0), FacingVerdict::Right);
        assert_eq!(verdict(1.0), FacingVerdict::Right);
        assert_eq!(verdict(FRAC_PI_2), FacingVerdict::Undecided);
        assert_eq!(verdict(PI), FacingVerdict::Reversed);
        assert_eq!(verdict(-2.4), FacingVerdict::Reversed);
    }

    #[test]
    fn one_frame_does_not_turn_who_was_right_for_long() {
        let settings = FacingSettings::default();
        let (front, back) = (
            votes([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            votes([0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
        );
        let mut belief = FacingBelief::NEW;
        for _ in 0..5 {
            belief.update(Some(0.0), 0.0, &front, &settings);
        }
        belief.update(Some(0.0), 0.0, &back, &settings);
        assert_eq!(belief.verdict(&settings), FacingVerdict::Right);
        for _ in 0..3 {
            belief.update(Some(0.0), 0.0, &back, &settings);
        }
        assert_eq!(belief.verdict(&settings), FacingVerdict::Reversed);
        belief.turn();
        assert_eq!(belief.verdict(&settings), FacingVerdict::Right);
    }

    #[test]
    fn no_votes_and_an_even_belief_decide_nothing() {
        let settings = FacingSettings::default();
        for votes in [YawBelief::default(), votes([0.125; YAW_BINS])] {
            let mut belief = FacingBelief::NEW;
            for _ in 0..50 {
                belief.update(Some(0.3), 0.0, &votes, &settings);
            }
            assert_eq!(belief.verdict(&settings), FacingVerdict::Undecided);
        }
        let mut lying = FacingBelief::NEW;
        lying.update(None, 0.0, &votes([0.125; YAW_BINS]), &settings);
        assert_eq!(lying.verdict(&settings), FacingVerdict::Right);
    }

    #[test]
    fn walking_tips_what_is_in_doubt_and_alone_decides_nothing() {
        let settings = FacingSettings::default();
        let front = votes([0.5, 0.1, 0.02, 0.03, 0.18, 0.07, 0.05, 0.05]);
        let after = |forward: f32, votes: &YawBelief| {
            let mut belief = FacingBelief::NEW;
            for _ in 0..6 {
                belief.update(Some(0.0), forward, votes, &settings);
            }
            belief.log_odds
        };
        let standing = after(0.1, &front);
        assert_eq!(standing, after(0.0, &front), "a sway is no step");
        assert!(after(0.9, &front) > standing && after(-0.9, &front) < standing);
        let nothing = YawBelief::default();
        assert!((0.5..settings.sure).contains(&after(0.9, &nothing)));
    }
}
