//! Pass two: garments over the captured picture, by coverage and visibility.

use super::area::Area;
use super::captured_depth::AreaDepth;
use super::coverage::PixelCoverage;
use super::grain::Grain;
use super::shading::{ShadedFace, Shader};
use super::workspace::Workspace;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::par::{self, Par};
use tryon_geometry::raster::VisibilityBuffer;

/// Rows of the picture blended by one task.
const ROWS: usize = 8;

/// Input of [`blend`](Blender::blend).
pub(super) struct Blender<'a> {
    pub(super) shader: Shader<'a>,
    pub(super) work: &'a Workspace,
    pub(super) area: &'a Area,
    /// Samples along each side of a pixel.
    pub(super) samples: usize,
    pub(super) depth: &'a AreaDepth,
    /// Grain on garments.
    pub(super) grain: Grain,
}

impl Blender<'_> {
    /// Blends the drawn area over the captured picture in `image`.
    pub(super) fn blend(&self, par: Par, image: &mut ColorImage) {
        let area = self.area;
        let (left, width) = (area.left as usize, area.width as usize);
        let row_bytes = 3 * image.width() as usize;
        let first = area.top as usize * row_bytes;
        let last = first + area.height as usize * row_bytes;
        let rows = &mut image.data_mut()[first..last];
        par::for_chunks(par, rows, row_bytes * ROWS, |start, chunk| {
            let mut cache = ShadedFace::default();
            for (k, row) in chunk.chunks_mut(row_bytes).enumerate() {
                let y = start / row_bytes + k;
                let row = &mut row[3 * left..3 * (left + width)];
                for (x, out) in row.chunks_exact_mut(3).enumerate() {
                    self.blend_pixel(&mut cache, x, y, out);
                }
            }
        });
    }

    fn blend_pixel(&self, cache: &mut ShadedFace, x: usize, y: usize, out: &mut [u8]) {
        let work = self.work;
        let i = y * self.area.width as usize + x;
        let p = &work.pixels[i];
        if p.covered == 0 && work.shadows.is_far(x, y) {
            return;
        }
        let lights = &self.shader.lights;
        let around = work.shadows.at(x, y);
        let full = 1.0 / (self.samples * self.samples) as f32;
        let alpha = work.matte.alpha[i];
        let cover = f32::from(p.covered) * full * (1.0 - alpha);
        let mut behind = [0, 1, 2].map(|c| f32::from(out[c]));
        if cover < 1.0 {
            let light = around.on_captured(lights, self.depth.at(x, y), alpha);
            behind = behind.map(|c| c * light);
        }
        let mut color = [0.0; 3];
        if cover > 0.0 {
            color = self.garment_color(cache, p, [x, y], lights.contact * around.front);
            let [u, v] = [self.area.left + x as u32, self.area.top + y as u32];
            let grain = self.grain.at(u, v);
            color = color.map(|c| (c + grain).clamp(0.0, 255.0));
        }
        for c in 0..3 {
            out[c] = (behind[c] + (color[c] - behind[c]) * cover + 0.5) as u8;
        }
    }

    /// Mean sRGB of the garment samples of a pixel.
    #[inline]
    fn garment_color(
        &self,
        cache: &mut ShadedFace,
        p: &PixelCoverage,
        [x, y]: [usize; 2],
        shadow: f32,
    ) -> [f32; 3] {
        let (left, top) = (self.area.left as usize, self.area.top as usize);
        let [u, v] = [(left + x) as f32, (top + y) as f32];
        if p.is_simple {
            return self.shader.color(cache, p.face, [u, v], shadow);
        }
        let (n, width) = (self.samples, self.area.width as usize);
        let offset = |s: usize| (s as f32 + 0.5) / n as f32 - 0.5;
        let samples = &self.shader.surface.samples.face;
        let mut sum = [0.0; 3];
        for sy in 0..n {
            for sx in 0..n {
                let face = samples[(y * n + sy) * width * n + x * n + sx];
                if face != VisibilityBuffer::NONE {
                    let at = [u + offset(sx), v + offset(sy)];
                    let c = self.shader.color(cache, face, at, shadow);
                    (0..3).for_each(|k| sum[k] += c[k]);
                }
            }
        }
        sum.map(|s| s / f32::from(p.covered))
    }
}
