//! Labelled points of one scan while they pass through the scanner.

use tryon_geometry::math::{P3, V3};

/// Label of skin and hair.
pub const SKIN_LABEL: u8 = 0;
/// Label of what is no point of the subject.
pub const STRAY_LABEL: u8 = u8::MAX;

/// Points with their attributes, all of shape `[points]`.
#[derive(Clone, Debug, Default)]
pub(super) struct ScanPoints {
    /// Positions, world (m).
    pub(super) points: Vec<P3>,
    /// Unit normals towards the camera that saw the point.
    pub(super) normals: Vec<V3>,
    /// Colours, sRGB, 0 to 255.
    pub(super) colors: Vec<[f32; 3]>,
    /// Garment number from 1, [`SKIN_LABEL`] or [`STRAY_LABEL`].
    pub(super) labels: Vec<u8>,
}

impl ScanPoints {
    /// Number of points.
    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// Adds a point.
    pub(super) fn push(&mut self, point: P3, normal: V3, color: [f32; 3], label: u8) {
        self.points.push(point);
        self.normals.push(normal);
        self.colors.push(color);
        self.labels.push(label);
    }

    /// The points for which `keep` is true. Shape of `keep`: `[points]`.
    pub(super) fn filtered(&self, keep: &[bool]) -> Self {
        let mut out = Self::default();
        for i in (0..self.len()).filter(|i| keep[*i]) {
            let (color, label) = (self.colors[i], self.labels[i]);
            out.push(self.points[i], self.normals[i], color, label);
        }
        out
    }
}
