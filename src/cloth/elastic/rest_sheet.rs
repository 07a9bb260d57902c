//! Rest shape of a sheet: triangles in material coordinates, and the angles between them.

use super::ElasticError;
use nalgebra::{Matrix2, Vector2};
use tryon_geometry::math::V3d;

/// Triangles of a sheet at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RestSheet {
    /// Vertex indices, counter-clockwise, shape `[faces]`.
    pub faces: Vec<[u32; 3]>,
    /// Material coordinates (u along the weft, v along the warp) of each corner (m), shape `[faces]`. Each face may have a
    /// frame of its own: corners of one vertex need not agree, so panels are sewn by sharing vertices.
    pub corners: Vec<[Vector2<f64>; 3]>,
    /// Rest positions (m) whose dihedral angles are the rest angles, shape `[vertices]`; flat hinges without.
    pub folded: Option<Vec<V3d>>,
}

/// Triangle at rest with what its elements need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestTriangle {
    /// Corner coordinates (m).
    pub corners: [Vector2<f64>; 3],
    /// Area (m²).
    pub area: f64,
    /// Gradient of each corner's linear shape function (1/m).
    pub shape: [Vector2<f64>; 3],
}

impl RestTriangle {
    /// Triangle of these corners; `None` without area.
    pub fn new(corners: [Vector2<f64>; 3]) -> Option<Self> {
        let edges = Matrix2::from_columns(&[corners[1] - corners[0], corners[2] - corners[0]]);
        let area = 0.5 * edges.determinant().abs();
        let inverse = edges.try_inverse()?;
        if !(area > 0.0 && inverse.iter().all(|v| v.is_finite())) {
            return None;
        }
        let (b, c) = (inverse.row(0).transpose(), inverse.row(1).transpose());
        Some(Self {
            corners,
            area,
            shape: [-b - c, b, c],
        })
    }
}

impl RestSheet {
    /// Flat sheet with one material coordinate a vertex (m).
    ///
    /// # Errors
    /// [`ElasticError::Face`] for a face out of range.
    pub fn flat(faces: Vec<[u32; 3]>, at: &[Vector2<f64>]) -> Result<Self, ElasticError> {
        let corner =
            |face: usize, v: u32| at.get(v as usize).copied().ok_or(ElasticError::Face(face));
        let corners = faces
            .iter()
            .enumerate()
            .map(|(k, f)| Ok([corner(k, f[0])?, corner(k, f[1])?, corner(k, f[2])?]))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            faces,
            corners,
            folded: None,
        })
    }
    /// All triangles, checked.
    ///
    /// # Errors
    /// Names the face at fault.
    pub(super) fn triangles(&self, vertices: usize) -> Result<Vec<RestTriangle>, ElasticError> {
        if self.corners.len() != self.faces.len() {
            return Err(ElasticError::Length {
                field: "corners",
                found: self.corners.len(),
                needed: self.faces.len(),
            });
        }
        if let Some(folded) = self.folded.as_ref().filter(|f| f.len() != vertices) {
            return Err(ElasticError::Length {
                field: "folded",
                found: folded.len(),
                needed: vertices,
            });
        }
        self.faces
            .iter()
            .zip(&self.corners)
            .enumerate()
            .map(|(face, (f, corners))| {
                let repeated = f[0] == f[1] || f[1] == f[2] || f[2] == f[0];
                if repeated || f.iter().any(|&v| v as usize >= vertices) {
                    return Err(ElasticError::Face(face));
                }
                RestTriangle::new(*corners).ok_or(ElasticError::Area { face, area: 0.0 })
            })
            .collect()
    }
}
