//! Image on a fabric with smaller copies of itself, each of half the size: a pixel that spans many texels takes their mean.

use super::srgb::{ToSrgb, linear};
use std::fmt;
use tryon_garment::FabricImage;

/// Most levels; copies smaller than 1 / 32 would mix what lies far apart in an atlas.
const LEVELS: usize = 6;

/// Image of one level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Level {
    /// First texel.
    first: usize,
    width: usize,
    height: usize,
}

/// Levels of one image, ready for sampling on the processor and on the graphics card.
#[derive(Clone, PartialEq)]
pub struct ImagePyramid {
    levels: Vec<Level>,
    /// Texels of all levels, sRGB, 0xBBGGRR, row by row.
    texels: Vec<u32>,
    /// Linear light of each byte.
    light: Vec<f32>,
    /// Side of a texel of the first level on the cloth, metres.
    metres_per_texel: f32,
}

impl fmt::Debug for ImagePyramid {
    /// Levels alone: texels would fill pages.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ImagePyramid({:?})", self.levels)
    }
}

impl ImagePyramid {
    /// Levels of an image.
    pub fn new(image: &FabricImage) -> Self {
        let pixels = &image.pixels;
        let bytes = pixels.data().chunks_exact(3);
        let mut out = Self {
            levels: vec![Level {
                first: 0,
                width: pixels.width() as usize,
                height: pixels.height() as usize,
            }],
            texels: bytes.map(|c| packed([c[0], c[1], c[2]])).collect(),
            light: (0..=255).map(linear).collect(),
            metres_per_texel: image.metres_per_pixel,
        };
        while out.levels.len() < LEVELS && out.halve() {}
        out
    }

    /// Adds a level of half the size; false for one that cannot be halved.
    fn halve(&mut self) -> bool {
        let Some(&last) = self.levels.last() else {
            return false;
        };
        if last.width.min(last.height) < 2 {
            return false;
        }
        let next = Level {
            first: self.texels.len(),
            width: last.width.div_ceil(2),
            height: last.height.div_ceil(2),
        };
        let to_srgb = ToSrgb::default();
        for y in 0..next.height {
            for x in 0..next.width {
                let mut sum = [0.0; 3];
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let own = self.texel(last, 2 * x + dx, 2 * y + dy);
                    (0..3).for_each(|k| sum[k] += 0.25 * own[k]);
                }
                let mean = sum.map(|l| to_srgb.get(l).round() as u8);
                self.texels.push(packed(mean));
            }
        }
        self.levels.push(next);
        true
    }

    /// Linear light of a texel; outside of the level that of its border.
    #[inline]
    fn texel(&self, level: Level, x: usize, y: usize) -> [f32; 3] {
        let (x, y) = (x.min(level.width - 1), y.min(level.height - 1));
        let texel = self.texels[level.first + y * level.width + x];
        let [r, g, b, _] = texel.to_le_bytes();
        [r, g, b].map(|c| self.light[usize::from(c)])
    }

    /// Linear light at `at` metres from the upper left corner, as a pixel that spans `footprint` metres sees it.
    #[inline]
    pub(crate) fn sample(&self, at: [f32; 2], footprint: f32) -> [f32; 3] {
        let octave = (footprint / self.metres_per_texel).max(1.0).log2();
        let k = ((octave + 0.5) as usize).min(self.levels.len() - 1);
        let level = self.levels[k];
        let size = self.metres_per_texel * (1u32 << k) as f32;
        let place = |t: f32, n: usize| {
            let x = (t / size - 0.5).clamp(0.0, (n - 1) as f32);
            (x as usize, x - x.floor())
        };
        let (x, s) = place(at[0], level.width);
        let (y, t) = place(at[1], level.height);
        let [a, b] = [0, 1].map(|dx| self.texel(level, x + dx, y));
        let [c, d] = [0, 1].map(|dx| self.texel(level, x + dx, y + 1));
        std::array::from_fn(|k| {
            let top = a[k] + s * (b[k] - a[k]);
            let bottom = c[k] + s * (d[k] - c[k]);
            top + t * (bottom - top)
        })
    }

    /// Texels of all levels, sRGB, 0xBBGGRR.
    pub fn texels(&self) -> &[u32] {
        &self.texels
    }

    /// Columns, rows and levels.
    pub fn shape(&self) -> [u32; 3] {
        let first = self.levels[0];
        [first.width, first.height, self.levels.len()].map(|n| n as u32)
    }

    /// Side of a texel of the first level on the cloth, metres.
    pub fn metres_per_texel(&self) -> f32 {
        self.metres_per_texel
    }
}

fn packed([r, g, b]: [u8; 3]) -> u32 {
    u32::from_le_bytes([r, g, b, 0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::camera::ColorImage;

    /// Columns of black and white texels of 1 mm.
    fn columns() -> ImagePyramid {
        let row = |x: u32| {
            if x.is_multiple_of(2) {
                [0; 3]
            } else {
                [255; 3]
            }
        };
        let data = (0..64 * 16).flat_map(|i| row(i % 64));
        ImagePyramid::new(&FabricImage {
            pixels: ColorImage::new(64, 16, data.collect()).expect("sizes"),
            metres_per_pixel: 0.001,
        })
    }

    #[test]
    fn near_pixels_show_texels_and_far_ones_their_mean_in_linear_light() {
        let image = columns();
        assert_eq!(image.shape(), [64, 16, 5]);
        let near = |x: f32| image.sample([0.001 * (x + 0.5), 0.004], 1e-4)[0];
        assert_eq!((near(0.0), near(1.0)), (0.0, 1.0));
        assert!((near(0.25) - 0.25).abs() < 1e-4, "bilinear");
        for x in [0.0, 0.0131, 0.05, 9.0] {
            let far = image.sample([x, 0.004], 0.004)[0];
            assert!((far - 0.5).abs() < 0.01, "{far}");
        }
    }
}
