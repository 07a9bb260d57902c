//! Unit and frame of a mesh file.

use nalgebra::Matrix3;
use tryon_geometry::math::{P3, V3};

/// Map from a file's own unit and frame to metres, y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FileFrame {
    /// Metres in one unit of the file.
    pub(super) scale: f32,
    /// From the file's axes to y up, facing +z.
    pub(super) rotation: Matrix3<f32>,
    /// Added last, metres.
    pub(super) shift: V3,
}

impl FileFrame {
    /// The project's own frame.
    pub(super) fn metres() -> Self {
        Self {
            scale: 1.0,
            rotation: Matrix3::identity(),
            shift: V3::zeros(),
        }
    }
    pub(super) fn to_metres(self, p: &P3) -> P3 {
        self.rotation * p * self.scale + self.shift
    }
    /// Metres in a unit (m, dm, cm or mm) in which `extent` units lie strictly between `limits` (m).
    pub(super) fn unit_of(extent: f32, limits: [f32; 2]) -> Option<f32> {
        let mut units = [1.0f32, 0.1, 0.01, 0.001].into_iter();
        units.find(|s| extent * s > limits[0] && extent * s < limits[1])
    }
}

/// Lowest and highest corner of some points.
pub(super) fn bounds<'a>(points: impl Iterator<Item = &'a P3>) -> (P3, P3) {
    points.fold(
        (P3::from([f32::MAX; 3]), P3::from([f32::MIN; 3])),
        |(lo, hi), p| (lo.inf(p), hi.sup(p)),
    )
}
