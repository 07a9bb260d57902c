//! Records of a Wavefront OBJ file: vertices with colours, texture coordinates, triangles of its faces, their parts and lines.

use super::face_origins::FaceOrigins;
use std::collections::BTreeMap;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;

/// Records of a file; indices are in range and different within a face.
#[derive(Default)]
pub(super) struct ObjRecords {
    /// Positions.
    pub(super) vertices: Vec<P3>,
    /// Colours of the `v x y z r g b` extension as stored, shape `[vertices]`; NaN for a vertex without one.
    pub(super) colors: Vec<[f32; 3]>,
    /// Texture coordinates, v up.
    pub(super) uv: Vec<[f32; 2]>,
    /// Triangles of the polygons.
    pub(super) faces: Vec<Face>,
    /// Texture coordinates of the corners, shape `[faces]`; `None` where a corner of the polygon has none.
    pub(super) face_uv: Vec<Option<Face>>,
    /// Index in `materials`, shape `[faces]`; `None` before the first `usemtl`.
    pub(super) face_materials: Vec<Option<usize>>,
    /// Names that follow `usemtl`, in the order of the file.
    pub(super) materials: Vec<String>,
    /// Texts that follow `mtllib`.
    pub(super) libraries: Vec<String>,
    /// Part and line of each face.
    pub(super) origins: FaceOrigins,
    /// Changes, for people.
    pub(super) notes: Vec<String>,
    /// Faces that were left out or lost corners.
    pub(super) dropped: usize,
    /// Lines by their first word, the first few different ones.
    pub(super) words: BTreeMap<String, usize>,
    /// Lines.
    pub(super) count: usize,
}

impl ObjRecords {
    /// First words of the lines, for messages.
    pub(super) fn found(&self) -> String {
        let (v, f, n) = (self.vertices.len(), self.faces.len(), self.count);
        let words: Vec<String> = self
            .words
            .iter()
            .map(|(w, n)| format!("`{w}` ({n})"))
            .collect();
        let begin = if words.is_empty() {
            "all are empty".to_owned()
        } else {
            format!("they begin with {}", words.join(", "))
        };
        format!("{v} vertices (`v`) and {f} faces (`f`) in {n} lines; {begin}")
    }
    /// Note on elements that are no faces.
    pub(super) fn untaken(&self) -> Option<String> {
        let elements = ["l", "p", "curv", "curv2", "surf"];
        let found = elements
            .iter()
            .filter_map(|w| Some(format!("{} `{w}`", self.words.get(*w)?)));
        let found: Vec<String> = found.collect();
        (!found.is_empty()).then(|| {
            format!(
                "lines, points and free-form surfaces left out ({})",
                found.join(", ")
            )
        })
    }
}
