//! Outlines of garments as soft as the camera's edges: the composed picture is blurred along them.

use super::area::Area;
use super::coverage::PixelCoverage;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::par::{self, Par};

/// Variance of an edge that is the mean over a pixel.
const PIXEL: f32 = 1.0 / 12.0;
/// Variance of a blur that is too little to be seen.
const LEAST: f32 = 0.04;
/// Reach of the blur, pixels.
const REACH: usize = 2;
/// Rows blurred by one task.
const ROWS: usize = 8;

/// Outlines of the drawn garments in an area.
pub(crate) struct Outlines<'a> {
    pub(crate) area: &'a Area,
    pub(crate) pixels: &'a [PixelCoverage],
    /// Share of each pixel that is in front of the garments.
    pub(crate) alpha: &'a [f32],
    /// Samples of a whole pixel.
    pub(crate) full: u8,
}

/// Weights of a normal distribution of that variance at whole pixels.
fn kernel(variance: f32) -> [f32; 2 * REACH + 1] {
    let weights: [f32; 2 * REACH + 1] = std::array::from_fn(|k| {
        let d = k as f32 - REACH as f32;
        (-d * d / (2.0 * variance)).exp()
    });
    let sum: f32 = weights.iter().sum();
    weights.map(|w| w / sum)
}

impl Outlines<'_> {
    /// Blurs a picture along the outlines that are not hidden, to the camera's `sigma` (pixels).
    pub(crate) fn soften(&self, par: Par, sigma: f32, image: &mut ColorImage) {
        let variance = sigma * sigma - PIXEL;
        if variance < LEAST {
            return;
        }
        let weights = kernel(variance);
        let near = self.near();
        let sharp = image.clone();
        let (columns, rows) = (image.width() as usize, image.height() as usize);
        let (left, top) = (self.area.left as usize, self.area.top as usize);
        let width = self.area.width as usize;
        let bytes = 3 * columns;
        let drawn = top * bytes..(top + self.area.height as usize) * bytes;
        par::for_chunks(
            par,
            &mut image.data_mut()[drawn],
            bytes * ROWS,
            |start, chunk| {
                for (k, row) in chunk.chunks_mut(bytes).enumerate() {
                    let y = start / bytes + k;
                    for x in (0..width).filter(|x| near[y * width + x]) {
                        let (u, v) = (left + x, top + y);
                        let mut sum = [0.0; 3];
                        for (j, down) in weights.iter().enumerate() {
                            let r = (v + j).saturating_sub(REACH).min(rows - 1);
                            for (i, along) in weights.iter().enumerate() {
                                let c = (u + i).saturating_sub(REACH).min(columns - 1);
                                let pixel = &sharp.data()[3 * (r * columns + c)..][..3];
                                (0..3).for_each(|c| sum[c] += down * along * f32::from(pixel[c]));
                            }
                        }
                        row[3 * u..3 * u + 3].copy_from_slice(&sum.map(|s| (s + 0.5) as u8));
                    }
                }
            },
        );
    }

    /// Pixels within reach of an outline: a pixel that a garment covers in part, with two garments or folds, or beside one
    /// without a garment.
    fn near(&self) -> Vec<bool> {
        let (width, height) = (self.area.width as usize, self.area.height as usize);
        let mut out = vec![false; self.pixels.len()];
        for i in 0..self.pixels.len() {
            let p = &self.pixels[i];
            if p.covered == 0 || self.alpha[i] >= 0.5 {
                continue;
            }
            let (x, y) = (i % width, i / width);
            let is_bare = |k: usize| self.pixels[k].covered == 0;
            let is_outline = p.covered < self.full
                || !p.is_simple
                || x > 0 && is_bare(i - 1)
                || x + 1 < width && is_bare(i + 1)
                || y > 0 && is_bare(i - width)
                || y + 1 < height && is_bare(i + width);
            if !is_outline {
                continue;
            }
            let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(width);
            for v in y.saturating_sub(REACH)..(y + REACH + 1).min(height) {
                out[v * width + columns.start..v * width + columns.end].fill(true);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_gets_the_variance_of_the_camera_and_the_rest_stays() {
        let area = Area {
            left: 4,
            top: 0,
            width: 32,
            height: 12,
        };
        let pixel = |i: usize| PixelCoverage {
            covered: if i % 32 < 16 { 9 } else { 0 },
            ..PixelCoverage::default()
        };
        let pixels: Vec<PixelCoverage> = (0..area.len()).map(pixel).collect();
        let mut outlines = Outlines {
            area: &area,
            pixels: &pixels,
            alpha: &vec![0.0; area.len()],
            full: 9,
        };
        // The garment's last column is 19.
        let picture = |i: u32| if i % 40 < 20 { [200u8; 3] } else { [40; 3] };
        let data: Vec<u8> = (0..480).flat_map(picture).collect();
        let sharp = ColorImage::new(40, 12, data).expect("size");
        let mut soft = sharp.clone();
        outlines.soften(Par::Seq, 0.8, &mut soft);
        let level = |x: u32| f32::from(soft.at(x, 6)[0]);
        let slope = |x: u32| (level(x) - level(x + 1)) / 160.0;
        let variance: f32 = (0..39u32)
            .map(|x| slope(x) * (x as f32 - 19.0).powi(2))
            .sum();
        assert!((variance - (0.64 - PIXEL)).abs() < 0.05, "{variance}");
        assert_eq!((level(15), level(24)), (200.0, 40.0));

        let hidden = vec![1.0; area.len()];
        outlines.alpha = &hidden;
        let mut same = sharp.clone();
        outlines.soften(Par::Seq, 0.8, &mut same);
        assert_eq!(same, sharp);
        outlines.alpha = &[0.0; 384];
        outlines.soften(Par::Seq, 0.3, &mut same);
        assert_eq!(same, sharp);
    }
}
