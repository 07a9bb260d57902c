//! Fit of a worn outfit from step to step, and its return to how it was put on.

use super::settings::OutfitSettings;
use tryon_body::parts::BodyPart;
use tryon_cloth::{ClothError, Model, State, StepReport, WornReference};
use tryon_geometry::math::P3;

/// Steps in which an outfit that was put on again settles.
pub(super) const SETTLING: u32 = 4;
/// Torn steps of an outfit that doesn't settle after which it must be dressed anew, which takes 0.4 to 1 s: one second.
const MOST_VAIN: u32 = 30;

/// Fitness of an outfit over time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct WearState {
    /// Steps since the outfit was put on again; `None` once it has settled.
    settling: Option<u32>,
    /// Torn steps before it settled.
    vain: u32,
}

impl WearState {
    /// Takes the result of a step, after which the outfit may be torn: past what cloth can be, or off its limbs. True when
    /// it must be put on again.
    fn advance(&mut self, is_torn: bool, jumped: bool) -> bool {
        let put_on = jumped || is_torn;
        let settled = self.settling.map(|n| n + 1).filter(|n| *n < SETTLING);
        self.settling = if put_on { Some(0) } else { settled };
        self.vain = match self.settling {
            Some(_) => self.vain + u32::from(is_torn),
            None => 0,
        };
        put_on
    }
}

/// Watch over an outfit from step to step.
#[derive(Clone, Debug)]
pub(super) struct WearWatch {
    pub(super) settings: OutfitSettings,
    reference: WornReference,
    /// Mask of the part of each body vertex, shape `[body vertices]`.
    masks: Vec<u8>,
    state: WearState,
}

impl WearWatch {
    /// Watch over an outfit that has just been put on a body with these part `masks`.
    pub(super) fn new(
        model: &Model,
        state: &State,
        masks: Vec<u8>,
        settings: OutfitSettings,
    ) -> Self {
        Self {
            settings,
            reference: WornReference::new(model, state),
            masks,
            state: WearState::default(),
        }
    }

    /// Positions of each garment as skin carries it from where it was put on to `body` (world, metres).
    ///
    /// # Errors
    /// A body of another size or with a vertex that is not finite.
    pub(super) fn skinned(&self, model: &Model, body: &[P3]) -> Result<Vec<Vec<P3>>, ClothError> {
        self.reference.skinned(model, body)
    }

    /// True once putting it on again doesn't help: it was put on in a pose that the body never had.
    pub(super) fn is_past_mending(&self) -> bool {
        self.state.vain >= MOST_VAIN
    }

    /// True when a part of the body moves from `before` to `now` (metres) in `dt` seconds as no limb can.
    pub(super) fn has_jumped(&self, before: &[P3], now: &[P3], dt: f64) -> bool {
        let settings = &self.settings;
        let most = settings.jump.max((settings.jump_speed * dt) as f32);
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
        let settings = &self.settings;
        let is_torn = report.p99_strain > settings.most_strain
            || self.reference.limb_offset(model, state) > settings.most_offset;
        if self.state.advance(is_torn, jumped) {
            self.reference.put_on(model, state);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes `steps` in which the outfit is torn or not; the number of times that it is put on again.
    fn run(state: &mut WearState, steps: u32, is_torn: bool) -> u32 {
        let put_on = (0..steps).map(|_| u32::from(state.advance(is_torn, false)));
        put_on.sum()
    }

    #[test]
    fn a_torn_garment_is_put_on_again_at_once() {
        let mut state = WearState::default();
        assert_eq!(run(&mut state, 3, true), 3);
        assert_eq!((state.settling, state.vain), (Some(0), 3));
        run(&mut state, SETTLING, false);
        assert_eq!(state, WearState::default());
    }

    #[test]
    fn each_jump_puts_the_outfit_on_again_and_is_no_fault() {
        let mut state = WearState::default();
        assert!((0..50).all(|_| state.advance(false, true)));
        assert_eq!(state.vain, 0);
        run(&mut state, SETTLING, false);
        assert_eq!(state, WearState::default());
    }

    #[test]
    fn an_outfit_that_never_fits_is_past_mending_until_it_fits() {
        let mut state = WearState::default();
        assert_eq!(run(&mut state, MOST_VAIN, true), MOST_VAIN);
        assert_eq!(state.vain, MOST_VAIN);
        run(&mut state, SETTLING, false);
        assert_eq!(state, WearState::default());
    }
}
