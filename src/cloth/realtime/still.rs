//! When a body is still, and how its cloth comes to rest.

use super::state::State;
use crate::math::P3;

/// Skin of a trembling body that no cloth is near may move this many times as far: hands were seen to wander by 9 mm
/// where skin under cloth stayed within 4.
const ELSEWHERE: f32 = 4.0;
/// Sleeping cloth rides on a tracked body that sways, so many times as far as it may to let cloth fall asleep (a standing
/// person sways by one or two centimetres either way within some seconds), and by so many times from call to call (a
/// person who stands still is measured anew at every sixth picture only).
const SWAY: [f32; 2] = [5.0, 2.0];
/// A body that has moved less than this since the cloth was last computed is still, metres.
const STILL_BODY: f32 = 1e-3;
/// Cloth on a still body may swing out for this long, s; then nothing is faster than [`SETTLING`] m/s, and half as fast
/// every [`EASED`] s, down to [`CREEPING`] m/s. Between skins that touch cloth would jump from one to the other for ever.
/// With these a T-shirt over a skirt sleeps after 1.6 s, and is 8 mm (rms) from cloth that never slept when its wearer walks
/// off; what creeps counts as still.
const SWINGS_ON: f64 = 0.3;
const SETTLING: f64 = 2.0;
const EASED: f64 = 0.15;
const CREEPING: f64 = 0.01;

/// Speed of cloth on a body that has been still for `quiet_for` seconds, m/s; none where it may swing.
pub(super) fn coming_to_rest(quiet_for: f64) -> Option<f32> {
    let eased = (quiet_for - SWINGS_ON) / EASED;
    (eased > 0.0).then(|| (SETTLING * 0.5f64.powf(eased)).max(CREEPING) as f32)
}

/// The body is where it was when it last stirred: its skin under cloth, and roughly the rest of it, whose hands and feet
/// a tracker knows less well. Where noise was taken away, what is left of it is no motion either.
pub(super) fn is_quiet(steady: f64, state: &State, body: &[P3]) -> bool {
    let [worn, elsewhere] = stillness(steady);
    let within = |v: usize, most: f32| (body[v] - state.awake_body[v]).norm_squared() < most * most;
    (0..body.len()).all(|v| within(v, elsewhere)) && skin_worn(state).all(|v| within(v, worn))
}

/// Sleeping cloth rides on a tracked body that sways, until that has gone too far from where it fell asleep, or too fast.
pub(super) fn sleeps_on(steady: f64, state: &State, body: &[P3]) -> bool {
    let [worn, elsewhere] = stillness(steady);
    let [sway, hop] = if steady > 0.0 { SWAY } else { [1.0; 2] };
    let within =
        |from: &[P3], v: usize, most: f32| (body[v] - from[v]).norm_squared() < most * most;
    (0..body.len()).all(|v| within(&state.awake_body, v, sway * elsewhere))
        && skin_worn(state).all(|v| {
            within(&state.awake_body, v, sway * worn) && within(&state.body, v, hop * worn)
        })
}

/// How far skin under cloth, and any other, may be from where it last stirred, metres.
pub(super) fn stillness(steady: f64) -> [f32; 2] {
    let still = STILL_BODY.max(0.5 * steady as f32);
    [
        still,
        if steady > 0.0 {
            ELSEWHERE * still
        } else {
            still
        },
    ]
}

/// Skin that cloth lies on.
fn skin_worn(state: &State) -> impl Iterator<Item = usize> + '_ {
    state
        .garments
        .iter()
        .flat_map(|g| &g.nearest)
        .flatten()
        .map(|v| *v as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cloth_swings_on_and_then_slows_down_to_a_creep() {
        assert!((0..=9).all(|i| coming_to_rest(f64::from(i) / 30.0).is_none()));
        let speeds: Vec<f32> = (10..90)
            .filter_map(|i| coming_to_rest(f64::from(i) / 30.0))
            .collect();
        assert_eq!(speeds.len(), 80);
        assert!(
            speeds.windows(2).all(|s| s[1] <= s[0]) && speeds[0] < 2.0 && speeds[79] == 0.01,
            "{speeds:?}"
        );
        let later = coming_to_rest(SWINGS_ON + 2.0 * EASED).expect("a limit");
        assert!((later - 0.5).abs() < 1e-6, "{later}");
    }
}
