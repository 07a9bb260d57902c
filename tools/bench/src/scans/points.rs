//! Labelled points of one scan while they pass through the scanner.

use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;

/// Label of skin and hair.
pub const SKIN_LABEL: u8 = 0;
/// Label of floor points and of a held object.
pub const STRAY_LABEL: u8 = u8::MAX;

/// Points with their attributes, all of shape `[points]`.
#[derive(Clone, Debug, Default)]
pub(super) struct ScanPoints {
    /// Positions, world (m).
    pub(super) points: Vec<P3>,
    /// Unit normals towards the camera that saw the point.
    pub(super) normals: Vec<V3>,
    /// Colours, sRGB, 0 to 255; NaN where lost.
    pub(super) colors: Vec<[f32; 3]>,
    /// Garment number from 1, [`SKIN_LABEL`] or [`STRAY_LABEL`].
    pub(super) labels: Vec<u8>,
    /// Triangles; empty for a cloud.
    pub(super) faces: Vec<Face>,
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

    /// The points for which `keep` is true, with the faces between them. Shape of `keep`: `[points]`.
    pub(super) fn filtered(&self, keep: &[bool]) -> Self {
        let mut out = Self::default();
        let mut index = vec![u32::MAX; self.len()];
        for i in (0..self.len()).filter(|i| keep[*i]) {
            index[i] = out.len() as u32;
            let (color, label) = (self.colors[i], self.labels[i]);
            out.push(self.points[i], self.normals[i], color, label);
        }
        let faces = self.faces.iter();
        let faces = faces.map(|f| f.map(|v| index[v as usize]));
        out.faces = faces.filter(|f| f.iter().all(|v| *v != u32::MAX)).collect();
        out
    }
}
