//! Grain of the camera: measured in the captured picture, and given to the garments, which would look pasted in without.

use super::settings::GrainSettings;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::math::order_statistics::median;

/// Quotient of the median of |N| and the deviation of N for normal numbers, and gain of the kernel.
const MEDIAN: f32 = 0.6745;
const GAIN: f32 = 6.0;

/// Share of red, green and blue in brightness (ITU-R BT.709), and the variance that rounding them to whole levels gives it.
const LUMA: [f32; 3] = [0.2126, 0.7152, 0.0722];
const ROUNDING: f32 = 0.0468;
/// Distance over which a slope is told, pixels.
const REACH: usize = 2;

/// Standard deviation of the noise of a captured picture where `has_reading` of column and row, grey levels; `None` with too
/// little to see. The kernel `[1 −2 1; −2 4 −2; 1 −2 1]` takes away all that is smooth (Immerkær 1996), the least slopes leave
/// out hair and fabrics, and the median what is left of edges.
pub(crate) fn measure(
    image: &ColorImage,
    has_reading: impl Fn(u32, u32) -> bool,
    settings: &GrainSettings,
) -> Option<f32> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    if width <= 2 * REACH || height <= 2 * REACH {
        return None;
    }
    let at = |x: usize, y: usize| {
        let pixel = &image.data()[3 * (y * width + x)..][..3];
        (0..3).map(|c| LUMA[c] * f32::from(pixel[c])).sum::<f32>()
    };
    let mut seen = Vec::new();
    for y in (REACH..height - REACH).step_by(settings.step) {
        for x in (REACH..width - REACH).step_by(settings.step) {
            let middle = at(x, y);
            let is_exposed = (settings.exposed[0]..=settings.exposed[1]).contains(&(middle as u8));
            if !is_exposed || !has_reading(x as u32, y as u32) {
                continue;
            }
            let sides = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1);
            let corners = at(x - 1, y - 1) + at(x + 1, y - 1) + at(x - 1, y + 1) + at(x + 1, y + 1);
            let across = at(x + REACH, y) - at(x - REACH, y);
            let down = at(x, y + REACH) - at(x, y - REACH);
            let response = 4.0 * middle - 2.0 * sides + corners;
            seen.push((across.abs() + down.abs(), response.abs()));
        }
    }
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    let smooth = (seen.len() as f32 * settings.smooth) as usize;
    let mut seen: Vec<f32> = seen[..smooth].iter().map(|s| s.1).collect();
    let sigma = (seen.len() >= settings.least).then(|| median(&mut seen))??;
    let variance = (sigma / (MEDIAN * GAIN)).powi(2) - ROUNDING;
    Some(variance.max(0.0).sqrt().min(settings.most))
}

/// Grain of one picture.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Grain {
    /// Standard deviation, grey levels.
    pub(crate) sigma: f32,
    /// Number of the picture: each has another grain.
    pub(crate) picture: u32,
}

impl Grain {
    /// Difference at a pixel, grey levels.
    #[inline]
    pub(crate) fn at(&self, x: u32, y: u32) -> f32 {
        self.sigma * noise(x, y, self.picture)
    }
}

/// A number of mean 0 and deviation 1, nearly normal, for a pixel of a picture: the sum of four bytes of a hash.
#[inline]
fn noise(x: u32, y: u32, picture: u32) -> f32 {
    let mut h = x
        .wrapping_mul(0x9e37_79b9)
        .wrapping_add(y.wrapping_mul(0x85eb_ca6b))
        .wrapping_add(picture.wrapping_mul(0xc2b2_ae35));
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^= h >> 16;
    let sum = (h & 255) + (h >> 8 & 255) + (h >> 16 & 255) + (h >> 24);
    // Four uniform bytes have a deviation of 147.8.
    (sum as f32 - 510.0) * (1.0 / 147.8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn everywhere(_: u32, _: u32) -> bool {
        true
    }

    /// A ramp with edges, and noise of a deviation.
    fn picture(sigma: f32) -> ColorImage {
        let pixel = |i: u32| {
            let (x, y) = (i % 160, i / 160);
            let base = 60.0
                + 0.5 * x as f32
                + if (x / 20 + y / 20).is_multiple_of(2) {
                    40.0
                } else {
                    0.0
                };
            [(base + sigma * noise(x, y, 3)).round().clamp(0.0, 255.0) as u8; 3]
        };
        ColorImage::new(160, 120, (0..160 * 120).flat_map(pixel).collect()).expect("size")
    }

    #[test]
    fn noise_is_normal_and_new_in_each_picture() {
        let values: Vec<f32> = (0..10_000).map(|i| noise(i % 100, i / 100, 7)).collect();
        let mean = values.iter().sum::<f32>() / 1e4;
        let square = values.iter().map(|v| v * v).sum::<f32>() / 1e4;
        assert!(
            mean.abs() < 0.03 && (square - 1.0).abs() < 0.05,
            "{mean} {square}"
        );
        let beside: f32 = (0..9_999).map(|i| values[i] * values[i + 1]).sum::<f32>() / 1e4;
        assert!(beside.abs() < 0.05, "{beside}");
        assert_ne!(noise(5, 5, 1), noise(5, 5, 2));
    }

    #[test]
    fn the_grain_of_a_picture_with_edges_is_measured() {
        let settings = GrainSettings::default();
        for sigma in [1.0, 1.5] {
            let found = measure(&picture(sigma), everywhere, &settings).expect("seen");
            assert!((found - sigma).abs() < 0.25, "{sigma}: {found}");
        }
        assert!(measure(&picture(9.0), everywhere, &settings).expect("seen") <= settings.most);
        assert_eq!(
            measure(&ColorImage::filled(160, 120, [0; 3]), everywhere, &settings),
            None
        );
        assert_eq!(
            measure(&ColorImage::filled(2, 2, [90; 3]), everywhere, &settings),
            None
        );
    }
}
