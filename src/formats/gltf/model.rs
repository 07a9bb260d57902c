//! Triangles of a glTF scene as one mesh with parts.

use super::file::{GltfFile, Purpose};
use super::part::GltfPart;
use super::scene_reader::{SceneReader, SceneTriangles};
use super::uri::MAX_BYTES;
use crate::image::read_limited;
use crate::obj::ObjMesh;
use crate::{FaceOrigin, FaceOrigins, FormatError, TexturePoint};
use std::path::Path;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Face, TriMesh};

/// Triangles of a glTF scene in one mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GltfModel {
    /// Vertices and triangles of all parts at rest, in the frame of the scene, checked.
    pub mesh: TriMesh,
    /// Texture coordinates, shape `[vertices]`; empty when a part has none.
    pub uv: Vec<[f32; 2]>,
    /// The primitives, in the order of the scene; one for each instance.
    pub parts: Vec<GltfPart>,
    /// Elements left out, for people.
    pub notes: Vec<String>,
}

/// Scene as stored: positions may be non-finite; indices are in range.
pub(crate) struct GltfScan {
    /// Positions of all primitives, in the frame of the scene.
    pub(crate) points: Vec<P3>,
    /// Triangles of all primitives.
    pub(crate) faces: Vec<Face>,
    /// Base colours, sRGB, 0 to 255, shape `[points]`; NaN where a primitive has none.
    pub(crate) colors: Vec<[f32; 3]>,
    /// Colours of the textures between the vertices.
    pub(crate) texture: Vec<TexturePoint>,
    /// Part of each triangle.
    pub(crate) origins: FaceOrigins,
    /// Elements left out, for people.
    pub(crate) notes: Vec<String>,
}

/// Reads all triangles of the default scene at rest: transforms of nodes, morph weights, skins and instances applied.
///
/// # Errors
/// Names the mesh and the accessor, face or vertex at fault, or the required extension that is not read.
pub fn read_glb(path: &Path) -> Result<GltfModel, FormatError> {
    parse_gltf(&read_limited(path, MAX_BYTES)?, path)
}

/// Parses the bytes of a file as [`read_glb`] does; external buffers lie beside `origin`.
///
/// # Errors
/// As [`read_glb`].
pub fn parse_gltf(bytes: &[u8], origin: &Path) -> Result<GltfModel, FormatError> {
    let file = GltfFile::open(bytes, origin, Purpose::Geometry)?;
    let SceneTriangles {
        vertices,
        faces,
        mut uv,
        parts,
        notes,
        ..
    } = SceneReader::new(origin, &file, Purpose::Geometry).read()?;
    if uv.len() != vertices.len() {
        uv.clear();
    }
    let mesh = TriMesh::new(vertices, faces)
        .map_err(|e| FormatError::field(origin, "mesh", e.to_string()))?;
    Ok(GltfModel {
        mesh,
        uv,
        parts,
        notes,
    })
}

/// Reads all triangles of the default scene with the base colours of their vertices.
///
/// # Errors
/// As [`read_glb`], except for positions that are not finite; names a texture that is missing.
pub(crate) fn read_gltf_scan(path: &Path) -> Result<GltfScan, FormatError> {
    let bytes = read_limited(path, MAX_BYTES)?;
    let file = GltfFile::open(&bytes, path, Purpose::Scan)?;
    let scene = SceneReader::new(path, &file, Purpose::Scan).read()?;
    Ok(GltfScan {
        points: scene.vertices,
        faces: scene.faces,
        colors: scene.colors,
        texture: scene.texture,
        origins: origins(&scene.parts),
        notes: scene.notes,
    })
}

impl GltfModel {
    /// The same with corners that index texture coordinates separately, and with the part of each face.
    pub fn into_obj(self) -> ObjMesh {
        let face_uv = match self.uv.is_empty() {
            true => Vec::new(),
            false => self.mesh.faces().to_vec(),
        };
        ObjMesh {
            origins: origins(&self.parts),
            mesh: self.mesh,
            uv: self.uv,
            face_uv,
            notes: self.notes,
            ..ObjMesh::default()
        }
    }
}

/// Part of each triangle of a model.
fn origins(parts: &[GltfPart]) -> FaceOrigins {
    let faces = (0u32..).zip(parts).flat_map(|(part, p)| {
        let origin = FaceOrigin { part, line: 0 };
        p.faces.clone().map(move |_| origin)
    });
    FaceOrigins {
        faces: faces.collect(),
        parts: parts.iter().map(|p| p.names.clone()).collect(),
    }
}
