//! Contact shadows between garments and what they touch: blurred coverage at half resolution.

use super::area::Area;
use super::config::Lights;

/// Share of `Lights::contact_depth` by which noise may put a shadowed pixel in front of the garment.
const SHADOW_FRONT: f32 = 0.2;
/// Largest radius of the blur, cells.
const MAX_RADIUS: f32 = 16.0;
/// Garment share below which no shadow is visible (one grey level at full contact).
pub(crate) const NO_SHADOW: f32 = 4e-3;

/// Blurred coverage of every second pixel both ways.
#[derive(Clone, Debug, Default)]
pub(crate) struct ContactShadows {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Garment coverage, depth times that, occluder coverage, unused; shape `[height, width]`.
    pub(crate) around: Vec<[f32; 4]>,
    scratch: Vec<[f32; 4]>,
}

/// Blurred coverage around one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadowSample {
    /// Share that is garment.
    pub(crate) garment: f32,
    /// Depth of the garment times that share.
    pub(crate) depth: f32,
    /// Share that is in front of a garment.
    pub(crate) front: f32,
}

impl ShadowSample {
    /// Light left on a captured pixel at depth `z` (metres, 0 = unknown) that is in front of a garment by `alpha`.
    #[inline]
    pub(crate) fn on_captured(&self, lights: &Lights, z: f32, alpha: f32) -> f32 {
        if self.garment < NO_SHADOW || z <= 0.0 {
            return 1.0;
        }
        let (gap, depth) = (z - self.depth / self.garment, lights.contact_depth);
        if !(-SHADOW_FRONT * depth..=depth).contains(&gap) {
            return 1.0;
        }
        let fade = 1.0 - (gap / depth).max(0.0);
        1.0 - lights.contact * self.garment * fade * (1.0 - alpha)
    }
}

impl ContactShadows {
    /// From coverage and depth of each pixel of `area`; `reach` in pixels.
    pub(crate) fn cast(
        &mut self,
        pixels: impl Iterator<Item = [f32; 2]>,
        alpha: &[f32],
        area: &Area,
        reach: f32,
    ) {
        let width = area.width as usize;
        (self.width, self.height) = (width.div_ceil(2), area.height.div_ceil(2) as usize);
        self.around.clear();
        self.around.resize(self.width * self.height, [0.0; 4]);
        // A cell has four pixels.
        for (i, ([cover, depth], a)) in pixels.zip(alpha).enumerate() {
            if cover > 0.0 {
                let slot = &mut self.around[i / width / 2 * self.width + i % width / 2];
                let visible = 0.25 * cover * (1.0 - a);
                slot[0] += visible;
                slot[1] += visible * depth;
                slot[2] += 0.25 * a;
            }
        }
        let radius = (0.25 * reach).round().clamp(1.0, MAX_RADIUS) as usize;
        for _ in 0..2 {
            blur(&mut self.around, &mut self.scratch, self.width, radius);
        }
    }

    /// No garment casts a shadow on a pixel of the area.
    #[inline]
    pub(crate) fn is_far(&self, x: usize, y: usize) -> bool {
        self.around[y / 2 * self.width + x / 2][0] < NO_SHADOW
    }

    /// Two cells and their weights along one axis. Odd pixels lie a quarter past their cell's centre, even ones before it.
    #[inline]
    fn taps(at: usize, cells: usize) -> [(usize, f32); 2] {
        let first = (at / 2 + at % 2).saturating_sub(1);
        let second = if at % 2 == 1 { 0.25 } else { 0.75 };
        [(first, 1.0 - second), ((first + 1).min(cells - 1), second)]
    }

    /// Bilinear at a pixel of the area.
    #[inline]
    pub(crate) fn at(&self, x: usize, y: usize) -> ShadowSample {
        let (x, y) = (Self::taps(x, self.width), Self::taps(y, self.height));
        let mut sum = [0.0f32; 4];
        for (row, wy) in y {
            for (column, wx) in x {
                let v = &self.around[row * self.width + column];
                (0..4).for_each(|k| sum[k] += v[k] * (wx * wy));
            }
        }
        let [garment, depth, front, _] = sum;
        ShadowSample {
            garment,
            depth,
            front,
        }
    }
}

/// Adds `sign · v` to a running sum.
#[inline]
fn add(sum: &mut [f32; 4], v: &[f32; 4], sign: f32) {
    (0..4).for_each(|k| sum[k] += sign * v[k]);
}

/// Box blur of side 2·radius + 1, both ways; zero outside.
fn blur(image: &mut [[f32; 4]], scratch: &mut Vec<[f32; 4]>, width: usize, radius: usize) {
    let scale = 1.0 / (2 * radius + 1) as f32;
    // Running sums leave a negative rounding residue in empty places.
    let mean = |sum: &[f32; 4]| sum.map(|s| (s * scale).max(0.0));
    scratch.clear();
    scratch.resize(image.len(), [0.0; 4]);
    for (row, out) in image.chunks(width).zip(scratch.chunks_mut(width)) {
        let mut sum = [0.0; 4];
        row.iter().take(radius).for_each(|v| add(&mut sum, v, 1.0));
        for x in 0..width {
            if let Some(v) = row.get(x + radius) {
                add(&mut sum, v, 1.0);
            }
            out[x] = mean(&sum);
            if x >= radius {
                add(&mut sum, &row[x - radius], -1.0);
            }
        }
    }
    let height = image.len() / width;
    let mut sums = vec![[0.0; 4]; width];
    let add_row = |sums: &mut [[f32; 4]], y: usize, sign: f32| {
        let row = &scratch[y * width..(y + 1) * width];
        sums.iter_mut().zip(row).for_each(|(s, v)| add(s, v, sign));
    };
    (0..radius.min(height)).for_each(|y| add_row(&mut sums, y, 1.0));
    for (y, out) in image.chunks_mut(width).enumerate() {
        if y + radius < height {
            add_row(&mut sums, y + radius, 1.0);
        }
        out.iter_mut().zip(&sums).for_each(|(o, s)| *o = mean(s));
        if y >= radius {
            add_row(&mut sums, y - radius, -1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn running_blur_equals_direct_sums() {
        let (w, h, r) = (13usize, 9usize, 3usize);
        let image: Vec<[f32; 4]> = (0..w * h)
            .map(|i| [(i * 7 % 11) as f32, 1.0, (i % 3) as f32, 0.0])
            .collect();
        let mut fast = image.clone();
        blur(&mut fast, &mut Vec::new(), w, r);
        for y in 0..h {
            for x in 0..w {
                let mut sum = [0.0; 4];
                for v in y.saturating_sub(r)..(y + r + 1).min(h) {
                    for u in x.saturating_sub(r)..(x + r + 1).min(w) {
                        (0..4).for_each(|k| sum[k] += image[v * w + u][k] / 49.0);
                    }
                }
                (0..4).for_each(|k| {
                    assert!((sum[k] - fast[y * w + x][k]).abs() < 1e-4, "{x} {y} {k}")
                });
            }
        }
    }
}
