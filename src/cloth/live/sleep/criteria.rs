//! Thresholds below which body and cloth count as still.

use super::state::SleepState;
use crate::live::state::GarmentState;
use tryon_geometry::math::P3;

/// Displacement of a still exact body, metres.
const STILL_BODY: f32 = 1e-3;
/// Factor for skin without cloth on a tracked body: hands wander by 9 mm where skin under cloth stays within 4.
const BARE_SKIN: f32 = 4.0;
/// Factors within which a sleeping outfit follows a swaying tracked body: since sleep began, and per step.
const SWAY: [f32; 2] = [5.0, 2.0];
/// Speed below which 95 % of still cloth are, on an exact and on a tracked body, m/s; shaken skirts swing at 0.04 to 0.13.
const STILL_CLOTH: [f32; 2] = [0.02, 0.15];
/// Time for which cloth on a still body swings freely, s, before its speed is limited.
const FREE_SWING: f64 = 0.3;
/// Initial speed limit, m/s, its half-life, s, and its floor, m/s. With these a T-shirt over a skirt sleeps after 1.6 s,
/// 8 mm (rms) from cloth that never slept; without, cloth between touching skins jumps for ever.
const SPEED_LIMIT: f64 = 2.0;
const SPEED_HALF_LIFE: f64 = 0.15;
const SPEED_FLOOR: f64 = 0.01;

/// Speed limit of cloth on a body that has been still for `still_time` seconds, m/s; `None` while it may swing.
pub(in crate::live) fn speed_limit(still_time: f64) -> Option<f32> {
    let halvings = (still_time - FREE_SWING) / SPEED_HALF_LIFE;
    (halvings > 0.0).then(|| (SPEED_LIMIT * 0.5f64.powf(halvings)).max(SPEED_FLOOR) as f32)
}

/// Speed below which 95 % of still cloth are, m/s.
pub(super) fn still_cloth_speed(noise_deadband: f64) -> f32 {
    STILL_CLOTH[usize::from(noise_deadband > 0.0)]
}

/// Displacement of still skin under cloth and of bare skin, metres. What a filter leaves of noise is no motion.
pub(super) fn still_skin(noise_deadband: f64) -> [f32; 2] {
    let still = STILL_BODY.max(0.5 * noise_deadband as f32);
    let bare = if noise_deadband > 0.0 { BARE_SKIN } else { 1.0 };
    [still, bare * still]
}

/// The body is within the sleep thresholds of its reference.
pub(in crate::live) fn is_body_still(
    noise_deadband: f64,
    sleep: &SleepState,
    garments: &[GarmentState],
    body: &[P3],
) -> bool {
    let [worn, bare] = still_skin(noise_deadband);
    let moved = Displacements(body, &sleep.reference);
    moved.all_within(bare) && skin_under_cloth(garments).all(|v| moved.is_within(v, worn))
}

/// A sleeping outfit can follow the body, which was at `last`, without waking.
pub(super) fn stays_asleep(
    noise_deadband: f64,
    sleep: &SleepState,
    garments: &[GarmentState],
    last: &[P3],
    body: &[P3],
) -> bool {
    let [worn, bare] = still_skin(noise_deadband);
    let [sway, per_step] = if noise_deadband > 0.0 { SWAY } else { [1.0; 2] };
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
        assert!((0..=9).all(|i| speed_limit(f64::from(i) / 30.0).is_none()));
        let speeds: Vec<f32> = (10..90)
            .filter_map(|i| speed_limit(f64::from(i) / 30.0))
            .collect();
        assert_eq!(speeds.len(), 80);
        assert!(speeds.windows(2).all(|s| s[1] <= s[0]), "{speeds:?}");
        assert!(speeds[0] < 2.0 && speeds[79] == 0.01, "{speeds:?}");
        let later = speed_limit(FREE_SWING + 2.0 * SPEED_HALF_LIFE).expect("a limit");
        assert!((later - 0.5).abs() < 1e-6, "{later}");
    }
}
