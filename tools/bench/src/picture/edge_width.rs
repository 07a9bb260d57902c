//! Width of edges from 10 to 90 per cent of their contrast.

use super::luma::Luma;

/// Least contrast of an edge whose width is told, grey levels.
const CONTRAST: f32 = 35.0;
/// Least gradient of a place that may be an edge, grey levels a pixel.
const STEEP: f32 = 6.0;
/// Reach of a profile to either side, and its step, pixels.
const REACH: f32 = 7.0;
const STEP: f32 = 0.25;
/// Share of the steepest slope below which a profile has ended.
const FLAT: f32 = 0.06;
/// Lines along the edge whose mean is a profile.
const LINES: [f32; 3] = [-1.0, 0.0, 1.0];

/// Widths of the edges at pixels of a mask that are steepest along their gradient, pixels.
pub(super) fn widths(luma: &Luma, mask: &[bool]) -> Vec<f32> {
    let mut out = Vec::new();
    for y in 2..luma.height.saturating_sub(2) {
        for x in 2..luma.width.saturating_sub(2) {
            if !mask[y * luma.width + x] {
                continue;
            }
            let [gx, gy] = luma.gradient(x, y);
            let steepness = gx.hypot(gy);
            if steepness < STEEP {
                continue;
            }
            let across = [gx / steepness, gy / steepness];
            let beside = |sign: f32| {
                let [u, v] = [x as f32 + sign * across[0], y as f32 + sign * across[1]];
                let [a, b] = luma.gradient(u.round() as usize, v.round() as usize);
                a.hypot(b)
            };
            if steepness >= beside(1.0) && steepness > beside(-1.0) {
                out.extend(width(luma, [x as f32, y as f32], across));
            }
        }
    }
    out
}

/// Width of the edge at a point, `across` it to the brighter side; `None` of a low or broken one.
fn width(luma: &Luma, at: [f32; 2], across: [f32; 2]) -> Option<f32> {
    let n = (REACH / STEP) as i32;
    let level = |k: i32| -> Option<f32> {
        let t = k as f32 * STEP;
        let line = |s: &f32| {
            let x = at[0] + t * across[0] - s * across[1];
            let y = at[1] + t * across[1] + s * across[0];
            luma.between([x, y])
        };
        let levels: Option<Vec<f32>> = LINES.iter().map(line).collect();
        levels.map(|l| l.iter().sum::<f32>() / LINES.len() as f32)
    };
    let profile: Vec<f32> = (-n..=n).map(level).collect::<Option<_>>()?;
    // Slope over a pixel, so that noise ends no profile.
    let half = (0.5 / STEP) as usize;
    let slope = |i: usize| profile[i + half] - profile[i - half];
    let (first, last) = (half, profile.len() - 1 - half);
    let middle = n as usize;
    let peak = (middle - half..=middle + half).max_by(|a, b| slope(*a).total_cmp(&slope(*b)))?;
    let least = FLAT * slope(peak);
    let from = (first..=peak).rev().find(|i| slope(*i) < least)?;
    let to = (peak..=last).find(|i| slope(*i) < least)?;
    let (low, high) = (profile[from], profile[to]);
    if high - low < CONTRAST {
        return None;
    }
    let crossing = |share: f32| {
        let level = low + share * (high - low);
        let i = (from..to).find(|i| profile[*i] <= level && profile[*i + 1] > level)?;
        let rest = (level - profile[i]) / (profile[i + 1] - profile[i]);
        Some((i as f32 + rest) * STEP)
    };
    Some(crossing(0.9)? - crossing(0.1)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::math::order_statistics::median;

    /// A slanted edge blurred by a normal distribution.
    fn edge(sigma: f64) -> Luma {
        let normal = |z: f64| 1.0 / (1.0 + (-1.5976 * z - 0.070_56 * z.powi(3)).exp());
        Luma::from_fn(60, 60, |x, y| {
            let d = 0.8 * (x as f64 - 30.3) + 0.6 * (y as f64 - 29.6);
            (60.0 + 120.0 * normal(d / sigma)) as f32
        })
    }

    #[test]
    fn a_normal_blur_is_as_wide_as_its_quantiles() {
        for sigma in [0.8, 1.2, 1.6] {
            let luma = edge(sigma);
            let mut found = widths(&luma, &[true; 3600]);
            assert!(found.len() > 30);
            let found = f64::from(median(&mut found).expect("some"));
            let truth = 2.563 * sigma;
            assert!(
                (found / truth - 1.0).abs() < 0.12,
                "{sigma}: {found} for {truth}"
            );
        }
    }

    #[test]
    fn low_edges_and_flat_pictures_have_none() {
        let low = Luma::from_fn(40, 40, |x, _| if x < 20 { 100.0 } else { 120.0 });
        assert!(widths(&low, &[true; 1600]).is_empty());
        let flat = Luma::from_fn(40, 40, |_, _| 9.0);
        assert!(widths(&flat, &[true; 1600]).is_empty());
    }
}
