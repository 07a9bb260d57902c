//! A body that trembles as it is measured, held steady: cloth shall follow the shopper and not the sensor's noise.

use crate::math::P3;
use crate::par::{self, Par};

/// Calls a second that [`SHARE`] is meant for.
const RATE: f64 = 30.0;
/// Share of the way that the least movement is followed in one call: what trembles by 1 mm moves cloth at 1.5 mm/s, and
/// still nothing is left behind for longer than a second.
const SHARE: f32 = 0.05;

/// Moves `body` towards where it was measured, each vertex by a share that grows with the square of its distance: all of
/// it from `steady` metres on, hardly any of a tremble. Lags slow motion by less than half of `steady`, fast motion not
/// at all. With `steady` = 0 the measured body is taken as it is.
pub(super) fn follow(par: Par, body: &mut [P3], measured: &[P3], steady: f64, dt: f64) {
    if steady <= 0.0 {
        body.copy_from_slice(measured);
        return;
    }
    let (calls, far) = ((dt * RATE) as f32, (steady * steady) as f32);
    par::for_chunks(par, body, 2048, |start, some| {
        for (b, m) in some.iter_mut().zip(&measured[start..]) {
            let way = m - *b;
            let near = 1.0 - (way.norm_squared() / far).min(1.0);
            let left = ((1.0 - SHARE) * near).powf(calls);
            *b += way * (1.0 - left);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    const STEADY: f64 = 5e-3;
    const DT: f64 = 1.0 / 30.0;

    #[test]
    fn noise_is_held_and_motion_is_followed() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(5);
        let mut noise = || {
            (0..3)
                .map(|_| rng.random_range(-1.0f32..1.0))
                .collect::<Vec<_>>()
        };
        let mut body = vec![P3::origin()];
        let (mut fastest, mut farthest) = (0.0f32, 0.0f32);
        for _ in 0..300 {
            let (n, before) = (noise(), body[0]);
            follow(
                Par::Seq,
                &mut body,
                &[P3::new(1.5e-3 * n[0], 1.5e-3 * n[1], 1.5e-3 * n[2])],
                STEADY,
                DT,
            );
            fastest = fastest.max((body[0] - before).norm());
            farthest = farthest.max(body[0].coords.norm());
        }
        // The measured point moves by up to 5 mm from call to call.
        assert!(fastest < 1e-3 && farthest < 1.2e-3, "{fastest} {farthest}");
        for speed in [0.02f32, 0.1, 0.5, 3.0] {
            let (mut body, mut lag) = (vec![P3::origin()], 0.0f32);
            for i in 1..200 {
                let at = P3::new(speed * i as f32 * DT as f32, 0.0, 0.0);
                follow(Par::Seq, &mut body, &[at], STEADY, DT);
                lag = (at - body[0]).norm();
            }
            assert!(lag < 0.5 * STEADY as f32, "{speed} m/s: {lag}");
        }
    }

    #[test]
    fn two_half_calls_are_one_and_zero_takes_the_measured_body() {
        let (mut once, mut twice, mut plain) =
            (vec![P3::origin()], vec![P3::origin()], vec![P3::origin()]);
        let at = [P3::new(1e-4, 0.0, 0.0)];
        follow(Par::Seq, &mut once, &at, STEADY, DT);
        follow(Par::Seq, &mut twice, &at, STEADY, DT / 2.0);
        follow(Par::Seq, &mut twice, &at, STEADY, DT / 2.0);
        assert!(
            (once[0].x - twice[0].x).abs() < 1e-3 * once[0].x,
            "{} {}",
            once[0].x,
            twice[0].x
        );
        follow(Par::Seq, &mut plain, &at, 0.0, DT);
        assert_eq!(plain, at);
    }
}
