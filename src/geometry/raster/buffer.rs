//! Visibility buffer: depth and face number per pixel.

use super::View;
use super::hiz::DepthTiles;
use super::screen::Corner;

/// Arrays kept between pictures, so that a second one allocates nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct RasterScratch {
    /// Snapped vertices.
    pub(super) corners: Vec<Corner>,
    /// First and last band of every face.
    pub(super) ranges: Vec<[u8; 2]>,
    /// Scratch of every band.
    pub(super) bands: Vec<BandScratch>,
}

/// Scratch of one band of rows.
#[derive(Clone, Debug, Default)]
pub(super) struct BandScratch {
    pub(super) tiles: DepthTiles,
    /// Back faces that wait for the front faces.
    pub(super) back_faces: Vec<u32>,
}

/// Nearest surface per pixel: depth and face number. Arrays are row-major, shape `[height, width]`.
#[derive(Clone, Debug, Default)]
pub struct VisibilityBuffer {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Depth along the optical axis, metres; infinity in empty pixels.
    pub depth: Vec<f32>,
    /// Face number; [`VisibilityBuffer::NONE`] in empty pixels.
    pub face: Vec<u32>,
    /// Scratch of the rasteriser; no part of the picture.
    pub(super) scratch: RasterScratch,
}

impl PartialEq for VisibilityBuffer {
    fn eq(&self, other: &Self) -> bool {
        (self.width, self.height) == (other.width, other.height)
            && self.depth == other.depth
            && self.face == other.face
    }
}

impl VisibilityBuffer {
    /// Face number of an empty pixel.
    pub const NONE: u32 = u32::MAX;

    /// Clears the buffer to the size of `view`.
    pub fn reset(&mut self, view: &View) {
        (self.width, self.height) = view.size();
        let n = self.width as usize * self.height as usize;
        self.depth.clear();
        self.depth.resize(n, f32::INFINITY);
        self.face.clear();
        self.face.resize(n, Self::NONE);
    }
}
