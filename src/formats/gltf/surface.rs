//! Surface of one mesh to write: positions, normals, texture coordinates and triangles.

use super::document::GlbDocument;
use crate::FormatError;
use serde_json::{Value, json};
use std::collections::HashMap;
use std::path::Path;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Face, face_normal};

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
    /// Base colour, sRGB, of both sides; multiplies the texture.
    pub color: [u8; 3],
    /// PNG or JPEG file with the base colours at [`GlbMesh::uv`]; empty for none.
    pub texture: &'a [u8],
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
        if !self.texture.is_empty() {
            if self.uv.is_empty() {
                return fault("texture", "without texture coordinates".into());
            }
            if mime_type(self.texture).is_none() {
                return fault("texture", "neither PNG nor JPEG".into());
            }
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
        let texture = mime_type(self.texture).map(|mime| document.texture(self.texture, mime));
        let material = document.material(self.name, self.color, texture);
        json!({"attributes": attributes, "indices": indices, "material": material})
    }
}

/// Kind of an image file by its first bytes.
fn mime_type(image: &[u8]) -> Option<&'static str> {
    match image {
        [0x89, b'P', b'N', b'G', ..] => Some("image/png"),
        [0xff, 0xd8, ..] => Some("image/jpeg"),
        _ => None,
    }
}

/// True if all coordinates are finite.
pub(super) fn is_finite(points: &[P3]) -> bool {
    points.iter().all(|p| p.iter().all(|c| c.is_finite()))
}

/// Area-weighted vertex normals, shared by vertices at one position; +y for a vertex without a face.
pub(super) fn normals(vertices: &[P3], faces: &[Face]) -> Vec<V3> {
    let mut first = HashMap::new();
    let place = |(i, p): (usize, &P3)| {
        let key = [p.x, p.y, p.z].map(f32::to_bits);
        *first.entry(key).or_insert(i)
    };
    let places: Vec<usize> = vertices.iter().enumerate().map(place).collect();
    let mut sums = vec![V3::zeros(); vertices.len()];
    for f in faces {
        let n = face_normal(vertices, f);
        f.iter().for_each(|&i| sums[places[i as usize]] += n);
    }
    places
        .iter()
        .map(|i| sums[*i].try_normalize(0.0).unwrap_or(V3::y()))
        .collect()
}
