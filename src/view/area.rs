//! Rectangles of the picture in pixels.

/// Nothing nearer to the camera is drawn, metres.
pub(crate) const NEAR: f32 = 0.1;

/// A rectangle of the picture, pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Area {
    pub(crate) left: u32,
    pub(crate) top: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl Area {
    /// Number of pixels.
    pub(crate) fn len(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Pixel of the picture at index `i`, row by row.
    pub(crate) fn pixel(&self, i: usize) -> [u32; 2] {
        let (x, y) = (i as u32 % self.width, i as u32 / self.width);
        [self.left + x, self.top + y]
    }
}
