//! Fit of a worn outfit from step to step, and its return to how it was put on.

use crate::body::parts::BodyPart;
use crate::cloth::{Model, State, StepReport, WornReference};
use crate::math::P3;

/// Stretch that one edge in a hundred exceeds in a garment that is caught or torn: dances reach 0.25 for a frame.
const MOST_STRAIN: f64 = 0.25;
/// Largest median distance of a limb's cloth from where skin would carry it, metres: dances reach 63 mm.
const MOST_OFFSET: f32 = 0.1;
/// Unfit steps in a row after which an outfit is put on again: a sleeve finds its arm within nine, mostly within two.
const PATIENCE: u32 = 5;
/// Steps in which an outfit that was put on again settles, at least, and those after which it is put on once more: both
/// within the half second that a return may take.
const SETTLING: [u32; 2] = [4, 12];
/// Times that an outfit is put on again in vain before it must be dressed anew: a return takes 0.4 s, dressing 0.3 to 0.7 s.
const RETRIES: u32 = 3;
/// Mean displacement of a body part that is a jump, metres, and its least speed, m/s: a fast arm moves by 0.2 m in 1/30 s.
const JUMP: f32 = 0.25;
/// See [`JUMP`].
const JUMP_SPEED: f64 = 7.0;

/// Fitness of an outfit over time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct WearState {
    /// Unfit steps in a row.
    unfit: u32,
    /// Steps since the outfit was put on again; `None` while it is worn.
    settling: Option<u32>,
    /// Times in a row that it was put on again in vain.
    retries: u32,
}

impl WearState {
    /// Takes the result of a step; true when the outfit must be put on again.
    fn advance(&mut self, is_fit: bool, jumped: bool) -> bool {
        self.unfit = if is_fit { 0 } else { self.unfit + 1 };
        let settling = self.settling.map(|n| n + 1);
        let is_late = settling.map_or(self.unfit >= PATIENCE, |n| n >= SETTLING[1] && !is_fit);
        if jumped || is_late {
            self.retries += u32::from(is_late && settling.is_some());
            (self.unfit, self.settling) = (0, Some(0));
            return true;
        }
        self.settling = settling.filter(|n| *n < SETTLING[0] || !is_fit);
        if self.settling.is_none() && is_fit {
            self.retries = 0;
        }
        false
    }
}

/// Watch over an outfit from step to step.
#[derive(Debug)]
pub(super) struct WearWatch {
    reference: WornReference,
    /// Mask of the part of each body vertex, shape `[body vertices]`.
    masks: Vec<u8>,
    state: WearState,
}

impl WearWatch {
    /// Watch over an outfit that has just been put on a body with these part `masks`.
    pub(super) fn new(model: &Model, state: &State, masks: Vec<u8>) -> Self {
        Self {
            reference: WornReference::new(model, state),
            masks,
            state: WearState::default(),
        }
    }

    /// True while the outfit sits as it was put on.
    pub(super) fn is_worn(&self) -> bool {
        self.state.settling.is_none()
    }

    /// True once putting it on again doesn't help: it was put on in a pose that the body never had.
    pub(super) fn is_past_mending(&self) -> bool {
        self.state.retries >= RETRIES
    }

    /// True when a part of the body moves from `before` to `now` (metres) in `dt` seconds as no limb can.
    pub(super) fn has_jumped(&self, before: &[P3], now: &[P3], dt: f64) -> bool {
        let most = JUMP.max((JUMP_SPEED * dt) as f32);
        let moved = |part: BodyPart| {
            let vertices = self.masks.iter().zip(before).zip(now);
            let of = vertices.filter(|((mask, _), _)| **mask == part.mask());
            let distances = of.map(|((_, a), b)| (b - a).norm());
            let (sum, count) = distances.fold((0.0f32, 0.0f32), |(s, n), d| (s + d, n + 1.0));
            sum > most * count
        };
        BodyPart::ALL.into_iter().any(moved)
    }

    /// Judges a step of an outfit on a body that may have `jumped`, and puts it on again where it is past mending.
    pub(super) fn judge(
        &mut self,
        model: &Model,
        state: &mut State,
        report: &StepReport,
        jumped: bool,
    ) {
        let is_fit = report.p99_strain <= MOST_STRAIN
            && report.sleeves_put_back == 0
            && self.reference.limb_offset(model, state) <= MOST_OFFSET;
        if self.state.advance(is_fit, jumped) {
            self.reference.put_on(model, state);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes `steps` that are all `is_fit`; the number of times that the outfit is put on again.
    fn run(state: &mut WearState, steps: u32, is_fit: bool) -> u32 {
        let put_on = (0..steps).map(|_| u32::from(state.advance(is_fit, false)));
        put_on.sum()
    }

    #[test]
    fn short_faults_are_left_to_the_simulator_and_long_ones_end_in_a_hidden_return() {
        let mut state = WearState::default();
        assert_eq!(run(&mut state, PATIENCE - 1, false), 0);
        assert_eq!(run(&mut state, 1, true), 0);
        assert_eq!(state, WearState::default());

        assert_eq!(run(&mut state, PATIENCE, false), 1);
        assert_eq!(state.settling, Some(0));
        assert_eq!(run(&mut state, SETTLING[0] - 1, true), 0);
        assert!(state.settling.is_some(), "shown while it settles");
        run(&mut state, 1, true);
        assert_eq!(state, WearState::default());
    }

    #[test]
    fn a_jump_returns_at_once_and_is_no_vain_return() {
        let mut state = WearState::default();
        assert!((0..50).all(|_| state.advance(false, true)));
        assert_eq!((state.settling, state.retries), (Some(0), 0));
    }

    #[test]
    fn an_outfit_that_never_fits_is_past_mending_until_it_fits() {
        let mut state = WearState::default();
        run(&mut state, PATIENCE, false);
        assert_eq!(run(&mut state, RETRIES * SETTLING[1], false), RETRIES);
        assert_eq!(state.retries, RETRIES);
        run(&mut state, SETTLING[0], true);
        assert_eq!(state, WearState::default());
    }
}
