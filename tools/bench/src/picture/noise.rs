//! Deviation of the noise in smooth parts of a picture.

use super::luma::Luma;
use tryon_geometry::math::order_statistics::{median, percentile};

/// Quotient of the median of |N| and the deviation of N for normal numbers, and gain of the kernel (Immerkær 1996).
const MEDIAN: f32 = 0.6745;
const GAIN: f32 = 6.0;
/// Share of the pixels of a mask that are smooth: those of the least gradient over five pixels.
const SMOOTH_PERCENT: u32 = 40;
/// Fewest smooth pixels of which a noise is told.
const LEAST: usize = 400;

/// Standard deviation of the noise in the smooth part of a mask, grey levels; `None` of too little. The kernel
/// `[1 −2 1; −2 4 −2; 1 −2 1]` takes away all that is smooth, the median the rest of edges.
pub(super) fn deviation(luma: &Luma, mask: &[bool]) -> Option<f32> {
    const REACH: usize = 3;
    let mut seen = Vec::new();
    for y in REACH..luma.height.saturating_sub(REACH) {
        for x in REACH..luma.width.saturating_sub(REACH) {
            if !mask[y * luma.width + x] {
                continue;
            }
            let ring = |dx: isize, dy: isize| mean(luma, x, y, [dx, dy]);
            let slope = (ring(2, 0) - ring(-2, 0)).hypot(ring(0, 2) - ring(0, -2));
            seen.push((slope, response(luma, x, y)));
        }
    }
    let mut slopes: Vec<f32> = seen.iter().map(|s| s.0).collect();
    let smooth = percentile(&mut slopes, SMOOTH_PERCENT as usize)?;
    let mut of_smooth: Vec<f32> = (seen.iter())
        .filter(|s| s.0 <= smooth)
        .map(|s| s.1.abs())
        .collect();
    if of_smooth.len() < LEAST {
        return None;
    }
    median(&mut of_smooth).map(|m| m / (MEDIAN * GAIN))
}

/// Mean of three pixels across the way to a neighbour.
fn mean(luma: &Luma, x: usize, y: usize, [dx, dy]: [isize; 2]) -> f32 {
    let at = |k: isize| {
        let (sx, sy) = if dx == 0 { (k, dy) } else { (dx, k) };
        luma.at(x.wrapping_add_signed(sx), y.wrapping_add_signed(sy))
    };
    (at(-1) + at(0) + at(1)) / 3.0
}

fn response(luma: &Luma, x: usize, y: usize) -> f32 {
    let at = |dx: usize, dy: usize| luma.at(x + dx - 1, y + dy - 1);
    let sides = at(0, 1) + at(2, 1) + at(1, 0) + at(1, 2);
    let corners = at(0, 0) + at(2, 0) + at(0, 2) + at(2, 2);
    4.0 * at(1, 1) - 2.0 * sides + corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn known_noise_on_a_ramp_with_edges_is_measured() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(7);
        let noise: Vec<f32> = (0..200 * 160)
            .map(|_| StandardNormal.sample(&mut rng))
            .collect();
        for sigma in [0.5f32, 2.0] {
            let luma = Luma::from_fn(200, 160, |x, y| {
                let squares = if (x / 25 + y / 25) % 2 == 0 {
                    40.0
                } else {
                    0.0
                };
                60.0 + 0.3 * x as f32 + squares + sigma * noise[y * 200 + x]
            });
            let found = deviation(&luma, &vec![true; 200 * 160]).expect("seen");
            assert!((found / sigma - 1.0).abs() < 0.06, "{sigma}: {found}");
        }
        let flat = Luma::from_fn(20, 20, |_, _| 5.0);
        assert_eq!(deviation(&flat, &[true; 400]), None);
    }
}
