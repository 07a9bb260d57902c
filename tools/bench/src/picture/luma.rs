//! Brightness of a picture in grey levels, between pixels too.

use tryon_geometry::camera::ColorImage;

/// Brightness by pixel, 0 to 255.
pub(super) struct Luma {
    pub(super) width: usize,
    pub(super) height: usize,
    values: Vec<f32>,
}

/// Shares of red, green and blue in brightness (ITU-R BT.709).
const SHARES: [f32; 3] = [0.2126, 0.7152, 0.0722];

impl Luma {
    pub(super) fn of(image: &ColorImage) -> Self {
        let pixels = image.data().chunks_exact(3);
        let luma = |p: &[u8]| (0..3).map(|c| SHARES[c] * f32::from(p[c])).sum();
        Self {
            width: image.width() as usize,
            height: image.height() as usize,
            values: pixels.map(luma).collect(),
        }
    }

    #[cfg(test)]
    pub(super) fn from_fn(width: usize, height: usize, of: impl Fn(usize, usize) -> f32) -> Self {
        let values = (0..width * height).map(|i| of(i % width, i / width));
        Self {
            width,
            height,
            values: values.collect(),
        }
    }

    /// The mean of squares of 2 × 2 pixels.
    pub(super) fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mean = |i: usize| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            let rows =
                self.at(x, y) + self.at(x + 1, y) + self.at(x, y + 1) + self.at(x + 1, y + 1);
            0.25 * rows
        };
        Self {
            values: (0..width * height).map(mean).collect(),
            width,
            height,
        }
    }

    pub(super) fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }

    /// Bilinear value; `None` at the picture's border.
    pub(super) fn between(&self, [x, y]: [f32; 2]) -> Option<f32> {
        let (u, v) = (x.floor(), y.floor());
        let is_in = u >= 0.0 && v >= 0.0;
        if !is_in || u as usize + 1 >= self.width || v as usize + 1 >= self.height {
            return None;
        }
        let (i, k, s, t) = (u as usize, v as usize, x - u, y - v);
        let row = |k: usize| self.at(i, k) * (1.0 - s) + self.at(i + 1, k) * s;
        Some(row(k) * (1.0 - t) + row(k + 1) * t)
    }

    /// Gradient by Sobel's kernels, grey levels a pixel.
    pub(super) fn gradient(&self, x: usize, y: usize) -> [f32; 2] {
        let at = |dx: usize, dy: usize| self.at(x + dx - 1, y + dy - 1);
        let along = |d: usize, is_column: bool| {
            let at = |k: usize| if is_column { at(d, k) } else { at(k, d) };
            at(0) + 2.0 * at(1) + at(2)
        };
        [true, false].map(|is_column| (along(2, is_column) - along(0, is_column)) / 8.0)
    }
}
