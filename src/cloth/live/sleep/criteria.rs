//! Thresholds below which body and cloth count as still.

use super::state::SleepState;
use crate::live::state::GarmentState;
use crate::settings::{Config, StillnessSettings};
use tryon_geometry::math::P3;

impl StillnessSettings {
    /// Speed limit of cloth on a body that has been still for `still_time` seconds, m/s; `None` while it may swing.
    pub(in crate::live) fn speed_limit_after(&self, still_time: f64) -> Option<f32> {
        let halvings = (still_time - self.free_swing) / self.speed_half_life;
        let limit = || (self.speed_limit * 0.5f64.powf(halvings)).max(self.speed_floor);
        (halvings > 0.0).then(|| limit() as f32)
    }

    /// Displacement of still skin under cloth and of bare skin, metres. What a filter leaves of noise is no motion.
    pub(super) fn still_skin(&self, noise_deadband: f64) -> [f32; 2] {
        let still = self.still_body.max(0.5 * noise_deadband as f32);
        let bare = if noise_deadband > 0.0 {
            self.bare_skin
        } else {
            1.0
        };
        [still, bare * still]
    }
}

/// The body is within the sleep thresholds of its reference.
pub(in crate::live) fn is_body_still(
    config: &Config,
    sleep: &SleepState,
    garments: &[GarmentState],
    body: &[P3],
) -> bool {
    let [worn, bare] = config.stillness.still_skin(config.noise_deadband);
    let moved = Displacements(body, &sleep.reference);
    moved.all_within(bare) && skin_under_cloth(garments).all(|v| moved.is_within(v, worn))
}

/// A sleeping outfit can follow the body, which was at `last`, without waking.
pub(super) fn stays_asleep(
    config: &Config,
    sleep: &SleepState,
    garments: &[GarmentState],
    last: &[P3],
    body: &[P3],
) -> bool {
    let settings = &config.stillness;
    let [worn, bare] = settings.still_skin(config.noise_deadband);
    let [sway, per_step] = if config.noise_deadband > 0.0 {
        settings.sway
    } else {
        [1.0; 2]
    };
    let (moved, step) = (
        Displacements(body, &sleep.reference),
        Displacements(body, last),
    );
    moved.all_within(sway * bare)
        && skin_under_cloth(garments)
            .all(|v| moved.is_within(v, sway * worn) && step.is_within(v, per_step * worn))
}

/// Displacements between two bodies.
struct Displacements<'a>(&'a [P3], &'a [P3]);

impl Displacements<'_> {
    fn is_within(&self, v: usize, most: f32) -> bool {
        (self.0[v] - self.1[v]).norm_squared() < most * most
    }
    fn all_within(&self, most: f32) -> bool {
        (0..self.0.len()).all(|v| self.is_within(v, most))
    }
}

fn skin_under_cloth(garments: &[GarmentState]) -> impl Iterator<Item = usize> + '_ {
    let nearest = garments.iter().flat_map(|g| &g.nearest);
    nearest.flatten().map(|v| *v as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_limit_sets_in_after_the_free_swing_and_decays_to_its_floor() {
        let settings = StillnessSettings::default();
        let after = |frame: i32| settings.speed_limit_after(f64::from(frame) / 30.0);
        assert!((0..=17).all(|i| after(i).is_none()));
        let speeds: Vec<f32> = (19..90).filter_map(after).collect();
        assert_eq!(speeds.len(), 71);
        assert!(speeds.windows(2).all(|s| s[1] <= s[0]), "{speeds:?}");
        assert!(speeds[0] < 2.0 && speeds[70] == 0.01, "{speeds:?}");
        let two = settings.free_swing + 2.0 * settings.speed_half_life;
        let later = settings.speed_limit_after(two).expect("a limit");
        assert!((later - 0.5).abs() < 1e-6, "{later}");
    }
}
