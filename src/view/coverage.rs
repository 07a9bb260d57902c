//! Coverage of picture pixels by the samples of the garments' surface.

use super::area::Area;
use super::config::Config;
use super::surface::Surface;
use tryon_geometry::par::{self, Par};
use tryon_geometry::raster::VisibilityBuffer;

/// Coverage of one picture pixel, reduced from its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PixelCoverage {
    /// Nearest garment depth, metres; infinity where none.
    pub(crate) depth: f32,
    /// Its face.
    pub(crate) face: u32,
    /// Samples on a garment.
    pub(crate) covered: u8,
    /// All samples on one surface: one shading represents them.
    pub(crate) is_simple: bool,
}

impl Default for PixelCoverage {
    fn default() -> Self {
        Self {
            depth: f32::INFINITY,
            face: u32::MAX,
            covered: 0,
            is_simple: true,
        }
    }
}

/// Depth range of a pixel's samples above which they lie on different folds and are shaded apart, metres.
pub(crate) const FOLD_GAP: f32 = 0.012;
/// Rows of the picture reduced by one task.
const ROWS: usize = 8;

/// Reduces `n × n` samples to each pixel of `area`, and flags the faces they see as visible.
pub(crate) fn reduce_samples(
    par: Par,
    surface: &Surface,
    area: &Area,
    n: u32,
    out: &mut Vec<PixelCoverage>,
) {
    let (n, width) = (n as usize, area.width as usize);
    let stride = width * n;
    let samples = &surface.samples;
    out.resize(area.len(), PixelCoverage::default());
    par::for_chunks(par, out, width * ROWS, |start, chunk| {
        // Most neighbours see the same face: one flag store for all of them.
        let mut last = VisibilityBuffer::NONE;
        for (k, pixel) in chunk.iter_mut().enumerate() {
            let (x, y) = ((start + k) % width, (start + k) / width);
            let first = y * n * stride + x * n;
            let rows = |sy: usize| first + sy * stride..first + sy * stride + n;
            let id = samples.face[first];
            let is_uniform = (0..n).all(|sy| samples.face[rows(sy)].iter().all(|f| *f == id));
            if !is_uniform {
                *pixel = reduce_mixed(surface, (0..n).flat_map(rows));
                continue;
            }
            *pixel = PixelCoverage::default();
            if id == VisibilityBuffer::NONE {
                continue;
            }
            if id != last {
                surface.visible.set(id);
                last = id;
            }
            (pixel.face, pixel.covered) = (id, (n * n) as u8);
            let depths = (0..n).flat_map(|sy| &samples.depth[rows(sy)]);
            pixel.depth = depths.fold(f32::INFINITY, |z, d| z.min(*d));
        }
    });
}

/// Reduces samples that see different faces.
fn reduce_mixed(surface: &Surface, at: impl Iterator<Item = usize>) -> PixelCoverage {
    let garment = |face: u32| surface.garment[face as usize];
    let mut p = PixelCoverage::default();
    let mut far = 0f32;
    for i in at {
        let (d, f) = (surface.samples.depth[i], surface.samples.face[i]);
        if f == VisibilityBuffer::NONE {
            continue;
        }
        surface.visible.set(f);
        p.covered += 1;
        far = far.max(d);
        if p.face != u32::MAX {
            p.is_simple &= garment(p.face) == garment(f);
        }
        if d < p.depth {
            (p.depth, p.face) = (d, f);
        }
    }
    p.is_simple &= far - p.depth < FOLD_GAP;
    p
}

/// Removes the biases of layer and side, which order garments among themselves, from the depth of each pixel.
///
/// `surface.inner` must be known. Garments then meet the captured scene at the depth of their simulated vertices.
pub(super) fn remove_biases(config: &Config, surface: &Surface, pixels: &mut [PixelCoverage]) {
    for p in pixels.iter_mut().filter(|p| p.covered > 0) {
        let face = p.face as usize;
        p.depth += config.layer_bias * f32::from(surface.garment[face]);
        if surface.inner[face] {
            p.depth -= config.inner_bias;
        }
    }
}
