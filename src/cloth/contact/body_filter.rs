//! Noise dead band of a tracked body: cloth follows the subject, not the sensor's noise.

use crate::settings::CollisionConfig;
use tryon_geometry::math::P3;
use tryon_geometry::par;

/// Moves `body` towards `posed` (both `[vertices]`, metres) in `dt` seconds.
///
/// The share grows with the square of the distance and is 1 from `noise_deadband` metres on. Slow motion lags by less than
/// half of that, fast motion not at all. A dead band of 0 copies the posed body.
pub(super) fn filter_body(config: &CollisionConfig, body: &mut [P3], posed: &[P3], dt: f64) {
    let (noise_deadband, least) = (config.noise_deadband, config.least_share);
    if noise_deadband <= 0.0 {
        body.copy_from_slice(posed);
        return;
    }
    let (steps, full) = (
        (dt * config.filter_rate) as f32,
        (noise_deadband * noise_deadband) as f32,
    );
    par::for_chunks(config.par, body, 2048, |start, some| {
        for (b, m) in some.iter_mut().zip(&posed[start..]) {
            let displacement = m - *b;
            let near = 1.0 - (displacement.norm_squared() / full).min(1.0);
            let left = ((1.0 - least) * near).powf(steps);
            *b += displacement * (1.0 - left);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use tryon_geometry::par::Par;

    const DEADBAND: f64 = 5e-3;
    const DT: f64 = 1.0 / 30.0;

    fn follow(body: &mut [P3], posed: &[P3], noise_deadband: f64, dt: f64) {
        let config = CollisionConfig {
            noise_deadband,
            par: Par::Seq,
            ..CollisionConfig::default()
        };
        filter_body(&config, body, posed, dt);
    }

    #[test]
    fn noise_is_suppressed_and_motion_followed() {
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
            let at = P3::new(1.5e-3 * n[0], 1.5e-3 * n[1], 1.5e-3 * n[2]);
            follow(&mut body, &[at], DEADBAND, DT);
            fastest = fastest.max((body[0] - before).norm());
            farthest = farthest.max(body[0].coords.norm());
        }
        // The posed point moves by up to 5 mm from step to step.
        assert!(fastest < 1e-3 && farthest < 1.2e-3, "{fastest} {farthest}");
        for speed in [0.02f32, 0.1, 0.5, 3.0] {
            let (mut body, mut lag) = (vec![P3::origin()], 0.0f32);
            for i in 1..200 {
                let at = P3::new(speed * i as f32 * DT as f32, 0.0, 0.0);
                follow(&mut body, &[at], DEADBAND, DT);
                lag = (at - body[0]).norm();
            }
            assert!(lag < 0.5 * DEADBAND as f32, "{speed} m/s: {lag}");
        }
    }

    #[test]
    fn two_half_steps_equal_one_and_no_dead_band_copies_the_body() {
        let (mut once, mut twice, mut plain) =
            (vec![P3::origin()], vec![P3::origin()], vec![P3::origin()]);
        let at = [P3::new(1e-4, 0.0, 0.0)];
        follow(&mut once, &at, DEADBAND, DT);
        follow(&mut twice, &at, DEADBAND, DT / 2.0);
        follow(&mut twice, &at, DEADBAND, DT / 2.0);
        assert!(
            (once[0].x - twice[0].x).abs() < 1e-3 * once[0].x,
            "{} {}",
            once[0].x,
            twice[0].x
        );
        follow(&mut plain, &at, 0.0, DT);
        assert_eq!(plain, at);
    }
}
