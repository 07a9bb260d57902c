//! Captured colours and depth, by pixel of the picture.

use super::viewport::Viewport;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::math::P3;

/// Captured picture and depth.
#[derive(Clone, Copy)]
pub(crate) struct CapturedPixels<'a> {
    pub(crate) viewport: &'a Viewport,
    /// The captured picture at the output's size.
    pub(crate) image: &'a ColorImage,
    /// Captured depth, millimetres, shape `viewport.depth`.
    pub(crate) depth: &'a [u16],
}

impl CapturedPixels<'_> {
    /// Captured depth at a pixel, metres; 0 = none.
    pub(crate) fn metres(&self, u: u32, v: u32) -> f32 {
        let at = (self.viewport.depth_at(0, u), self.viewport.depth_at(1, v));
        let (Some(x), Some(y)) = at else { return 0.0 };
        f32::from(self.depth[(y * self.viewport.depth[0] + x) as usize]) * 1e-3
    }

    /// Colour and depth (metres, 0 = none) where a point of the picture's camera is seen; `None` beside the picture.
    pub(crate) fn at(&self, p: &P3) -> Option<([u8; 3], f32)> {
        let q = self.viewport.camera.project(p);
        let [u, v] = [q.x, q.y].map(f32::round);
        let (width, height) = (self.image.width() as f32, self.image.height() as f32);
        if !(u >= 0.0 && v >= 0.0 && u < width && v < height) {
            return None;
        }
        let (u, v) = (u as u32, v as u32);
        Some((self.image.at(u, v), self.metres(u, v)))
    }
}
