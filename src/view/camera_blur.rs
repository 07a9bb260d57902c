//! Blur of the camera, measured at edges of the captured picture: a garment's outline is to be as soft.
//!
//! A step of brightness that a normal distribution has blurred is steeper by √(1 + 1/σ²) than after one more blur of
//! deviation 1 (Zhuo & Sim 2011, Defocus map estimation from a single image). The median over many edges is the camera's.

use super::settings::BlurSettings;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::math::order_statistics::median;

/// One more blur, of variance 1.
const BLUR: [f32; 5] = [0.0625, 0.25, 0.375, 0.25, 0.0625];
/// Variance of the difference quotient over two pixels.
const QUOTIENT: f32 = 1.0 / 3.0;
/// Pixels at the ends of a line without an edge, and from an edge to a reading beside it: there is none at an outline.
const ENDS: usize = 4;

/// Standard deviation of the blur of a captured picture at edges with `has_reading` of column and row on a side, pixels;
/// `None` with too few. A pixel's own width is part of it.
pub(crate) fn measure(
    image: &ColorImage,
    has_reading: impl Fn(u32, u32) -> bool,
    settings: &BlurSettings,
) -> Option<f32> {
    let size = [image.width() as usize, image.height() as usize];
    // Green stands for brightness.
    let at = |x: usize, y: usize| f32::from(image.data()[3 * (y * size[0] + x) + 1]);
    let mut variances = Vec::new();
    let (mut line, mut slopes) = (Vec::new(), Vec::new());
    for is_row in [true, false] {
        let [length, lines] = if is_row { size } else { [size[1], size[0]] };
        let place = |i: usize, k: usize| if is_row { (i, k) } else { (k, i) };
        let value = |i: usize, k: usize| {
            let (x, y) = place(i, k);
            at(x, y)
        };
        let is_seen = |i: usize, k: usize| {
            let (x, y) = place(i, k);
            has_reading(x as u32, y as u32)
        };
        for k in (1..lines.saturating_sub(1)).step_by(settings.step) {
            line.clear();
            line.extend((0..length).map(|i| value(i, k)));
            slopes.clear();
            slopes.extend(line.windows(3).map(|w| 0.5 * (w[2] - w[0])));
            for i in ENDS + 1..length.saturating_sub(ENDS + 1) {
                let across = 0.5 * (value(i, k + 1) - value(i, k - 1));
                let edge = variance_at(&slopes, i - 1, across, settings);
                let is_beside = || is_seen(i - ENDS, k) || is_seen(i + ENDS, k);
                variances.extend(edge.filter(|_| is_beside()));
            }
        }
    }
    let enough = variances.len() >= settings.least;
    let variance = enough.then(|| median(&mut variances))??;
    Some((variance - QUOTIENT).max(0.0).sqrt().min(settings.most))
}

/// Variance of the edge at place `i` of the slopes of a line, the quotient's included; `None` where there is no steepest place
/// of an upright edge.
fn variance_at(slopes: &[f32], i: usize, across: f32, settings: &BlurSettings) -> Option<f32> {
    let here = slopes[i];
    let is_edge = here.abs() >= settings.steep
        && here.abs() >= slopes[i - 1].abs()
        && here.abs() > slopes[i + 1].abs()
        && across.abs() < settings.slanted * here.abs();
    if !is_edge {
        return None;
    }
    let softer: f32 = (BLUR.iter().zip(&slopes[i - 2..]))
        .map(|(w, s)| w * s)
        .sum();
    let ratio = here / softer;
    // A line of one pixel loses more than any step.
    (ratio > 1.0).then(|| 1.0 / (ratio * ratio - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Upright stripes with a slight slant, blurred.
    fn stripes(sigma: f64) -> ColorImage {
        let normal = |z: f64| 1.0 / (1.0 + (-1.5976 * z - 0.070_56 * z.powi(3)).exp());
        let pixel = |i: u32| {
            let (x, y) = (f64::from(i % 200), f64::from(i / 200));
            let at = x + 0.1 * y;
            let nearest = ((at / 25.0).round() * 25.0 - at) / sigma;
            let is_up = ((at / 25.0).round() as i64) % 2 == 0;
            let share = if is_up {
                normal(-nearest)
            } else {
                normal(nearest)
            };
            [(60.0 + 120.0 * share).round() as u8; 3]
        };
        ColorImage::new(200, 120, (0..200 * 120).flat_map(pixel).collect()).expect("size")
    }

    #[test]
    fn known_blur_is_measured_where_there_are_readings() {
        let settings = BlurSettings::default();
        for sigma in [0.7, 1.0] {
            let found = measure(&stripes(sigma), |_, _| true, &settings).expect("edges");
            assert!(
                (f64::from(found) / sigma - 1.0).abs() < 0.12,
                "{sigma}: {found}"
            );
        }
        assert!(measure(&stripes(3.0), |_, _| true, &settings).is_none_or(|b| b <= settings.most));
        assert_eq!(measure(&stripes(0.7), |_, _| false, &settings), None);
        assert_eq!(
            measure(&ColorImage::filled(4, 4, [9; 3]), |_, _| true, &settings),
            None
        );
    }
}
