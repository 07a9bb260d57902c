//! Surface of one mesh to write: positions, normals, texture coordinates and triangles.

use super::document::GlbDocument;
use crate::formats::FormatError;
use crate::math::{P3, V3};
use crate::mesh::{Face, face_normal};
use serde_json::{Value, json};
use std::path::Path;

/// Mesh to write: corners share position and texture coordinate. Metres, y up.
#[derive(Clone, Copy, Debug)]
pub struct GlbMesh<'a> {
    /// Its name.
    pub name: &'a str,
    /// Positions, shape `[vertices]`.
    pub vertices: &'a [P3],
    /// Triangles.
    pub faces: &'a [Face],
    /// Texture coordinates (v down, as in glTF), shape `[vertices]`; empty for none.
    pub uv: &'a [[f32; 2]],
    /// Base colour, sRGB, of both sides.
    pub color: [u8; 3],
}

impl GlbMesh<'_> {
    /// Checks indices, positions and lengths.
    pub(super) fn check(&self, origin: &Path) -> Result<(), FormatError> {
        let fault = |field: &str, why: String| {
            let field = format!("mesh `{}`.{field}", self.name);
            Err(FormatError::field(origin, field, why))
        };
        let n = self.vertices.len();
        if self.faces.is_empty() {
            return fault("faces", "none".into());
        }
        let corners = self.faces.iter().enumerate();
        let mut corners = corners.flat_map(|(f, corners)| corners.iter().map(move |k| (f, *k)));
        if let Some((f, k)) = corners.find(|(_, k)| *k as usize >= n) {
            let why = format!("face {f}: vertex index {k} is out of range ({n} vertices)");
            return fault("faces", why);
        }
        if !is_finite(self.vertices) {
            return fault("vertices", "a position is not finite".into());
        }
        if !self.uv.is_empty() && self.uv.len() != n {
            return fault("uv", format!("{} for {n} vertices", self.uv.len()));
        }
        Ok(())
    }

    /// Adds material and accessors; returns the primitive, with more attributes and targets for the caller to add.
    pub(super) fn primitive(&self, document: &mut GlbDocument) -> Value {
        let positions = self.vertices.iter().map(|p| [p.x, p.y, p.z]);
        let position = document.vectors("VEC3", positions, true);
        let normals = normals(self.vertices, self.faces);
        let normal = document.vectors("VEC3", normals.into_iter().map(Into::into), true);
        let mut attributes = json!({"POSITION": position, "NORMAL": normal});
        if !self.uv.is_empty() {
            let uv = self.uv.iter().copied();
            attributes["TEXCOORD_0"] = json!(document.vectors("VEC2", uv, true));
        }
        let indices = document.triangles(self.faces);
        let material = document.material(self.name, self.color);
        json!({"attributes": attributes, "indices": indices, "material": material})
    }
}

/// True if all coordinates are finite.
pub(super) fn is_finite(points: &[P3]) -> bool {
    points.iter().all(|p| p.iter().all(|c| c.is_finite()))
}

/// Area-weighted vertex normals; +y for a vertex without a face.
pub(super) fn normals(vertices: &[P3], faces: &[Face]) -> Vec<V3> {
    let mut out = vec![V3::zeros(); vertices.len()];
    for f in faces {
        let n = face_normal(vertices, f);
        f.iter().for_each(|&i| out[i as usize] += n);
    }
    out.iter()
        .map(|n| n.try_normalize(0.0).unwrap_or(V3::y()))
        .collect()
}
