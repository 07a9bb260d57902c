//! Soft shadows between garments and what they touch: blurred coverage at half resolution.

use super::surface::Area;

/// What lies this far behind a garment's edge still gets its shadow, metres.
pub(crate) const SHADOW_DEPTH: f32 = 0.10;
/// Less garment around than this casts no visible shadow (one grey level at full contact).
pub(crate) const NO_SHADOW: f32 = 4e-3;

/// Blurred neighbourhood of every second pixel both ways.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shadows {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Garment coverage, depth times that, occluder coverage, unused; shape `[height, width]`.
    pub(crate) around: Vec<[f32; 4]>,
    scratch: Vec<[f32; 4]>,
}

/// What is around a pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around {
    /// Share that is garment.
    pub(crate) garment: f32,
    /// Depth of the garment times that share.
    pub(crate) depth: f32,
    /// Share that is in front of a garment.
    pub(crate) front: f32,
}

impl Around {
    /// Light left on a captured pixel at depth `z` (metres, 0 = unknown) that is in front of a garment by `alpha`.
    #[inline]
    pub(crate) fn on_captured(&self, contact: f32, z: f32, alpha: f32) -> f32 {
        if self.garment < NO_SHADOW || z <= 0.0 {
            return 1.0;
        }
        let gap = z - self.depth / self.garment;
        if !(-0.2 * SHADOW_DEPTH..=SHADOW_DEPTH).contains(&gap) {
            return 1.0;
        }
        let fade = 1.0 - (gap / SHADOW_DEPTH).max(0.0);
        1.0 - contact * self.garment * fade * (1.0 - alpha)
    }
}

impl Shadows {
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
        for (i, ([cover, depth], a)) in pixels.zip(alpha).enumerate() {
            if cover > 0.0 {
                let slot = &mut self.around[i / width / 2 * self.width + i % width / 2];
                let seen = 0.25 * cover * (1.0 - a);
                slot[0] += seen;
                slot[1] += seen * depth;
                slot[2] += 0.25 * a;
            }
        }
        let radius = (0.25 * reach).round().clamp(1.0, 16.0) as usize;
        for _ in 0..2 {
            blur(&mut self.around, &mut self.scratch, self.width, radius);
        }
    }
    /// No garment near a pixel of the area.
    #[inline]
    pub(crate) fn is_far(&self, x: usize, y: usize) -> bool {
        self.around[y / 2 * self.width + x / 2][0] < NO_SHADOW
    }
    /// Bilinear at a pixel of the area.
    #[inline]
    pub(crate) fn at(&self, x: usize, y: usize) -> Around {
        // Odd pixels lie a quarter past their cell's centre, even ones a quarter before it.
        let (x0, y0) = (
            (x / 2 + x % 2).saturating_sub(1),
            (y / 2 + y % 2).saturating_sub(1),
        );
        let (x1, y1) = ((x0 + 1).min(self.width - 1), (y0 + 1).min(self.height - 1));
        let (wx, wy) = (
            if x % 2 == 1 { 0.25 } else { 0.75 },
            if y % 2 == 1 { 0.25 } else { 0.75 },
        );
        let (row0, row1) = (y0 * self.width, y1 * self.width);
        let corners = [
            (&self.around[row0 + x0], (1.0 - wx) * (1.0 - wy)),
            (&self.around[row0 + x1], wx * (1.0 - wy)),
            (&self.around[row1 + x0], (1.0 - wx) * wy),
            (&self.around[row1 + x1], wx * wy),
        ];
        let mut sum = [0.0f32; 4];
        for (v, w) in corners {
            for k in 0..4 {
                sum[k] += v[k] * w;
            }
        }
        let [garment, depth, front, _] = sum;
        Around {
            garment,
            depth,
            front,
        }
    }
}

/// Box blur of side 2·radius + 1, both ways; zero outside.
fn blur(image: &mut [[f32; 4]], scratch: &mut Vec<[f32; 4]>, width: usize, radius: usize) {
    let scale = 1.0 / (2 * radius + 1) as f32;
    let add = |s: &mut [f32; 4], v: &[f32; 4], sign: f32| (0..4).for_each(|k| s[k] += sign * v[k]);
    scratch.clear();
    scratch.resize(image.len(), [0.0; 4]);
    for (row, out) in image.chunks(width).zip(scratch.chunks_mut(width)) {
        let mut sum = [0.0; 4];
        row.iter().take(radius).for_each(|v| add(&mut sum, v, 1.0));
        for x in 0..width {
            if let Some(v) = row.get(x + radius) {
                add(&mut sum, v, 1.0);
            }
            // Running sums leave a rounding residue where nothing is.
            out[x] = sum.map(|s| (s * scale).max(0.0));
            if x >= radius {
                add(&mut sum, &row[x - radius], -1.0);
            }
        }
    }
    let height = image.len() / width;
    let mut sums = vec![[0.0; 4]; width];
    let row = |y: usize| &scratch[y * width..(y + 1) * width];
    for y in 0..radius.min(height) {
        sums.iter_mut()
            .zip(row(y))
            .for_each(|(s, v)| add(s, v, 1.0));
    }
    for y in 0..height {
        if y + radius < height {
            sums.iter_mut()
                .zip(row(y + radius))
                .for_each(|(s, v)| add(s, v, 1.0));
        }
        for (o, s) in image[y * width..(y + 1) * width].iter_mut().zip(&sums) {
            *o = s.map(|s| (s * scale).max(0.0));
        }
        if y >= radius {
            sums.iter_mut()
                .zip(row(y - radius))
                .for_each(|(s, v)| add(s, v, -1.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_running_blur_is_the_obvious_one() {
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
