//! Imaging of a colour camera: samples of a pixel, and grain as normal noise of brightness with a little of hue.

use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

/// Imaging of a colour camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorImaging {
    /// Samples along each side of a pixel that sees the body: 1 has hard edges.
    pub samples: u32,
    /// Standard deviation of the grain, levels of 255; 0 for none.
    pub grain: f32,
}

impl Default for ColorImaging {
    fn default() -> Self {
        Self {
            samples: 1,
            grain: 0.0,
        }
    }
}

/// Pixels of one stretch of noise: each begins anywhere in the table.
const STRETCH: usize = 4096;
/// Hue's share of the deviation.
const HUE: f64 = 0.35;

/// Table of noise, interleaved channels, levels of 255.
#[derive(Clone, Debug)]
pub(super) struct ColorGrain {
    table: Vec<i8>,
}

impl ColorGrain {
    /// Grain of a standard deviation (levels of 255); `None` of 0.
    pub(super) fn new(deviation: f32, seed: u64) -> Option<Self> {
        if deviation <= 0.0 {
            return None;
        }
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
        let pixel = |_| {
            let brightness = draw();
            [0; 3].map(|_| f64::from(deviation) * (brightness + HUE * draw()))
        };
        let levels = (0..2 * STRETCH).map(pixel);
        // A conversion of floats to integers saturates.
        let table = levels.flat_map(|p| p.map(|x| x.round() as i8)).collect();
        Some(Self { table })
    }

    /// Adds the grain of a frame to interleaved sRGB; a function of seed and frame.
    pub(super) fn add(&self, pixels: &mut [u8], seed: u64, frame: u64) {
        let mut rng = Pcg64Mcg::new(u128::from(seed) << 64 | u128::from(frame) << 1 | 1);
        for stretch in pixels.chunks_mut(3 * STRETCH) {
            let from = 3 * rng.random_range(0..STRETCH);
            for (level, noise) in stretch.iter_mut().zip(&self.table[from..]) {
                *level = level.saturating_add_signed(*noise);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grain_has_its_deviation_and_is_a_function_of_the_frame() {
        let grain = ColorGrain::new(2.0, 5).expect("some");
        let picture = |frame: u64| {
            let mut pixels = vec![100u8; 3 * 320 * 240];
            grain.add(&mut pixels, 5, frame);
            pixels
        };
        let first = picture(1);
        assert_eq!(first, picture(1));
        assert_ne!(first, picture(2));
        let squares = first.iter().map(|p| (f64::from(*p) - 100.0).powi(2));
        let deviation = (squares.sum::<f64>() / first.len() as f64).sqrt();
        assert!((deviation - 2.13).abs() < 0.15, "{deviation}");
        assert!(ColorGrain::new(0.0, 5).is_none());
    }
}
