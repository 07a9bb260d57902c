//! View of a picture: a pinhole camera or a parallel projection.

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
