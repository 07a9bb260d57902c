//! Meshes as glTF 2.0: writes `.glb` with materials and, if wanted, motion; reads `.glb` and `.gltf`.

mod reader;
mod writer;

pub use reader::{parse_gltf, read_glb};
pub use writer::{encode_glb, write_glb, write_glb_motion};

use crate::math::P3;
use crate::mesh::{Face, TriMesh};
use std::ops::Range;

/// A mesh to write: corners share position and texture coordinate. Metres, y up.
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
    /// Base colour, sRGB. Both sides are drawn, for cloth has two.
    pub color: [u8; 3],
}

/// What was read: all triangles in one mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GltfModel {
    /// Vertices and triangles of all parts, node transforms applied, checked.
    pub mesh: TriMesh,
    /// Texture coordinates, shape `[vertices]`; empty when a part has none.
    pub uv: Vec<[f32; 2]>,
    /// The primitives, in the order of the scene.
    pub parts: Vec<GltfPart>,
}

/// One primitive of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfPart {
    /// Name of its mesh.
    pub name: String,
    /// Its faces in [`GltfModel::mesh`].
    pub faces: Range<usize>,
    /// Base colour, linear RGBA.
    pub color: [f32; 4],
    /// Drawn from both sides.
    pub double_sided: bool,
}

#[cfg(test)]
mod tests;
