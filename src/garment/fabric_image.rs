//! Image printed on a fabric.

use std::fmt;
use tryon_geometry::camera::ColorImage;

/// Image on a garment whose texture coordinates are metres from the image's upper left corner, v down.
#[derive(Clone, PartialEq)]
pub struct FabricImage {
    /// Colours, sRGB.
    pub pixels: ColorImage,
    /// Side of a pixel on the cloth, metres.
    pub metres_per_pixel: f32,
}

impl fmt::Debug for FabricImage {
    /// Size alone: pixels would fill pages.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (w, h) = (self.pixels.width(), self.pixels.height());
        write!(f, "FabricImage({w}×{h}, {} m)", self.metres_per_pixel)
    }
}
