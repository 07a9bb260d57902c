//! Sampling tables of rectification: nearest for depth, bilinear in fixed point for colour.

use super::{ColorImage, DepthImage, undistort::LensRays};

/// Table entry of a pixel that the lens does not draw: outside every image.
const NOT_DRAWN: u32 = u32::MAX;
/// Bits of a bilinear weight along one axis (1/64 pixel): the sum over four pixels stays in 20 of a lane's 21 bits.
const WEIGHT_BITS: u32 = 6;
/// Weight 1.
const ONE: u64 = 1 << WEIGHT_BITS;
/// Half of the product of two weights of 1 in each of three lanes, for rounding.
const HALF: u64 = (ONE * ONE / 2) * (1 | 1 << 21 | 1 << 42);

/// Nearest source pixel of each rectified pixel (row-major); never blends across a depth edge.
#[derive(Clone, Debug)]
pub(super) struct DepthTable {
    source: Vec<u32>,
}

impl DepthTable {
    /// Table for images of `width` × `height`, four bytes a pixel.
    pub(super) fn new(rays: &LensRays, [width, height]: [u32; 2]) -> Self {
        let nearest = |at: [f64; 2]| {
            let [u, v] = at.map(f64::round);
            let is_inside = u >= 0.0 && v >= 0.0 && u < f64::from(width) && v < f64::from(height);
            is_inside.then(|| v as u32 * width + u as u32)
        };
        let source = pixels(width, height)
            .map(|p| rays.source(p).and_then(nearest).unwrap_or(NOT_DRAWN))
            .collect();
        Self { source }
    }

    /// Fills `out`; pixels that the lens does not draw become 0.
    pub(super) fn apply(&self, raw: &DepthImage, out: &mut DepthImage) {
        let raw = raw.data();
        for (out, source) in out.data_mut().iter_mut().zip(&self.source) {
            *out = raw.get(*source as usize).copied().unwrap_or(0);
        }
    }
}

/// Four neighbours of a sample: offset of the upper left one [bytes] and weights of the right and lower ones [1/64].
#[derive(Clone, Copy, Debug)]
struct ColorSample {
    offset: u32,
    right: u8,
    lower: u8,
}

/// Bilinear sample of each rectified pixel, row-major.
#[derive(Clone, Debug)]
pub(super) struct ColorTable {
    samples: Vec<ColorSample>,
}

impl ColorTable {
    /// Table for images of `width` × `height`, eight bytes a pixel; black everywhere where a side is below two pixels.
    pub(super) fn new(rays: &LensRays, [width, height]: [u32; 2]) -> Self {
        let samples = pixels(width, height)
            .map(|p| {
                let sample = rays.source(p).and_then(|at| sample(at, [width, height]));
                sample.unwrap_or(ColorSample {
                    offset: NOT_DRAWN,
                    right: 0,
                    lower: 0,
                })
            })
            .collect();
        Self { samples }
    }

    /// Fills `out`; pixels that the lens does not draw become black.
    pub(super) fn apply(&self, raw: &ColorImage, out: &mut ColorImage) {
        let (raw, stride) = (raw.data(), 3 * raw.width() as usize);
        let (pixels, _) = out.data_mut().as_chunks_mut::<3>();
        for (out, sample) in pixels.iter_mut().zip(&self.samples) {
            let at = sample.offset as usize;
            let rows = pair(raw, at).zip(pair(raw, at.saturating_add(stride)));
            *out = rows.map_or([0; 3], |rows| blend(sample, rows));
        }
    }
}

/// Centres of all pixels, row-major.
fn pixels(width: u32, height: u32) -> impl Iterator<Item = [f64; 2]> {
    (0..height).flat_map(move |v| (0..width).map(move |u| [f64::from(u), f64::from(v)]))
}

/// Sample between the pixel centres of an image; `None` outside.
fn sample([u, v]: [f64; 2], [width, height]: [u32; 2]) -> Option<ColorSample> {
    let (last_u, last_v) = (width.checked_sub(1)?, height.checked_sub(1)?);
    let is_inside = u >= 0.0 && v >= 0.0 && u <= f64::from(last_u) && v <= f64::from(last_v);
    if !is_inside || last_u == 0 || last_v == 0 {
        return None;
    }
    let (left, top) = ((u as u32).min(last_u - 1), (v as u32).min(last_v - 1));
    let weight = |at: f64, first: u32| ((at - f64::from(first)) * ONE as f64).round() as u8;
    Some(ColorSample {
        offset: 3 * (top * width + left),
        right: weight(u, left),
        lower: weight(v, top),
    })
}

/// Two neighbouring RGB pixels in the low 48 bits.
#[inline(always)]
fn pair(raw: &[u8], at: usize) -> Option<u64> {
    let [a, b, c, d, e, f] = *raw.get(at..)?.first_chunk::<6>()?;
    let (low, high) = (u32::from_le_bytes([a, b, c, d]), u16::from_le_bytes([e, f]));
    Some(u64::from(low) | u64::from(high) << 32)
}

/// RGB in three lanes of 21 bits, so that one product weighs all channels.
#[inline(always)]
fn lanes(rgb: u64) -> u64 {
    (rgb & 0xff) | (rgb & 0xff00) << 13 | (rgb & 0xff_0000) << 26
}

/// Weighted mean of an upper and a lower pair of pixels.
#[inline(always)]
fn blend(sample: &ColorSample, (upper, lower): (u64, u64)) -> [u8; 3] {
    let (right, down) = (u64::from(sample.right), u64::from(sample.lower));
    let row = |pair: u64| lanes(pair) * (ONE - right) + lanes(pair >> 24) * right;
    let sum = row(upper) * (ONE - down) + row(lower) * down + HALF;
    [0, 21, 42].map(|lane| (sum >> (lane + 2 * WEIGHT_BITS)) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bilinear interpolation in floating point.
    #[test]
    fn blends_are_weighted_means() {
        let rgb: Vec<u8> = (0..12).map(|i| (i * 89 % 256) as u8).collect();
        let image = ColorImage::new(2, 2, rgb).expect("2×2");
        for (u, v) in [(0.0, 0.0), (1.0, 1.0), (0.25, 0.5), (0.984375, 0.015625)] {
            let s = sample([u, v], [2, 2]).expect("inside");
            let rows = (pair(image.data(), 0), pair(image.data(), 6));
            let (Some(upper), Some(lower)) = rows else {
                panic!("two rows of two pixels");
            };
            let got = blend(&s, (upper, lower));
            for c in 0..3 {
                let at = |x: u32, y: u32| f64::from(image.at(x, y)[c]);
                let top = at(0, 0) * (1.0 - u) + at(1, 0) * u;
                let bottom = at(0, 1) * (1.0 - u) + at(1, 1) * u;
                let want = top * (1.0 - v) + bottom * v;
                assert!((f64::from(got[c]) - want).abs() <= 0.5 + 1e-9);
            }
        }
    }

    #[test]
    fn samples_outside_and_of_thin_images_are_none() {
        assert!(sample([-0.1, 0.0], [4, 4]).is_none());
        assert!(sample([3.01, 0.0], [4, 4]).is_none());
        assert!(sample([f64::NAN, 0.0], [4, 4]).is_none());
        assert!(sample([0.0, 0.0], [1, 4]).is_none());
        assert!(sample([0.0, 0.0], [0, 0]).is_none());
        assert!(sample([3.0, 3.0], [4, 4]).is_some());
    }
}
