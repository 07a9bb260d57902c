//! Where a picture is taken from, and what it holds.

use super::fast::Scratch;
use crate::camera::Intrinsics;
use crate::math::P3;

/// A camera for rasterising; points are given in its own frame (x right, y down, z forward, metres).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum View {
    /// Pinhole.
    Perspective {
        /// Projection and size.
        camera: Intrinsics,
        /// Surfaces nearer than this are clipped, metres.
        near: f32,
    },
    /// Parallel projection: column = (x − left) · pixels_per_metre, row = (y − top) · pixels_per_metre.
    Orthographic {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// x at the centre of column 0, metres.
        left: f32,
        /// y at the centre of row 0, metres.
        top: f32,
        /// Scale.
        pixels_per_metre: f32,
    },
}

impl View {
    /// Columns and rows.
    pub fn size(&self) -> (u32, u32) {
        match self {
            Self::Perspective { camera, .. } => (camera.width, camera.height),
            Self::Orthographic { width, height, .. } => (*width, *height),
        }
    }
    /// Column, row and depth of a point; `None` before the near plane.
    pub fn project(&self, p: &P3) -> Option<[f32; 3]> {
        match self {
            Self::Perspective { camera, near } => (p.z >= *near).then(|| {
                let q = camera.project(p);
                [q.x, q.y, p.z]
            }),
            Self::Orthographic {
                left,
                top,
                pixels_per_metre,
                ..
            } => Some([
                (p.x - left) * pixels_per_metre,
                (p.y - top) * pixels_per_metre,
                p.z,
            ]),
        }
    }
}

/// Nearest surface per pixel: depth and which triangle.
#[derive(Clone, Debug, Default)]
pub struct VisibilityBuffer {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Depth along the optical axis, metres; infinity where nothing is.
    pub depth: Vec<f32>,
    /// Face number; `u32::MAX` where nothing is.
    pub face: Vec<u32>,
    /// The rasteriser's own; says nothing about the picture.
    pub(super) scratch: Scratch,
}

impl PartialEq for VisibilityBuffer {
    fn eq(&self, other: &Self) -> bool {
        (self.width, self.height) == (other.width, other.height)
            && self.depth == other.depth
            && self.face == other.face
    }
}

impl VisibilityBuffer {
    /// No face at this pixel.
    pub const NONE: u32 = u32::MAX;

    /// Empties the buffer at the size of `view`.
    pub fn reset(&mut self, view: &View) {
        (self.width, self.height) = view.size();
        let n = self.width as usize * self.height as usize;
        self.depth.clear();
        self.depth.resize(n, f32::INFINITY);
        self.face.clear();
        self.face.resize(n, Self::NONE);
    }
}
