//! Meshes from glTF. Every accessor is checked against the size of its buffer before it is read.

use crate::formats::FormatError;
use crate::formats::image::read_limited;
use crate::math::P3;
use crate::mesh::{Face, TriMesh};
use ::gltf::accessor::{DataType, Dimensions};
use ::gltf::mesh::Mode;
use ::gltf::{Accessor, Gltf, Node, Primitive, Semantic};
use nalgebra::Matrix4;
use std::ops::Range;
use std::path::{Component, Path};

/// Largest file; a garment of 100,000 vertices takes 4 MB without its textures.
const MAX_BYTES: u64 = 512 << 20;
/// Deepest scene; deeper ones are cycles.
const MAX_DEPTH: usize = 64;
/// Most nodes of a scene; nodes shared by many parents multiply.
const MAX_NODES: usize = 10_000;
/// Most vertices of a scene; primitives that share one large accessor multiply.
const MAX_VERTICES: usize = 10_000_000;

/// Triangles of a glTF scene in one mesh.
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

/// Triangles read so far, and the buffers they come from.
struct SceneReader<'a> {
    path: &'a Path,
    buffers: Vec<Vec<u8>>,
    vertices: Vec<P3>,
    faces: Vec<Face>,
    uv: Vec<[f32; 2]>,
    parts: Vec<GltfPart>,
    nodes: usize,
}

/// Reads all triangles of the default scene, node transforms applied.
///
/// # Errors
/// Names the mesh and the accessor, face or vertex at fault.
pub fn read_glb(path: &Path) -> Result<GltfModel, FormatError> {
    parse_gltf(&read_limited(path, MAX_BYTES)?, path)
}

/// Parses the bytes of a file as [`read_glb`] does; external buffers lie beside `origin`.
///
/// # Errors
/// As [`read_glb`].
pub fn parse_gltf(bytes: &[u8], origin: &Path) -> Result<GltfModel, FormatError> {
    check_container(bytes, origin)?;
    check_positions(bytes, origin)?;
    let Gltf { document, blob } =
        Gltf::from_slice(bytes).map_err(|e| FormatError::field(origin, "gltf", e.to_string()))?;
    let mut blob = blob;
    let mut buffers = Vec::new();
    for b in document.buffers() {
        let field = format!("buffer {}", b.index());
        let data = match b.source() {
            ::gltf::buffer::Source::Bin => blob.take().ok_or_else(|| {
                FormatError::field(origin, &field, "the file has no binary chunk")
            })?,
            ::gltf::buffer::Source::Uri(uri) => external(uri, origin, &field)?,
        };
        if data.len() < b.length() {
            let why = format!("{} bytes, {} announced", data.len(), b.length());
            return Err(FormatError::field(origin, field, why));
        }
        buffers.push(data);
    }
    let mut file = SceneReader {
        path: origin,
        buffers,
        vertices: Vec::new(),
        faces: Vec::new(),
        uv: Vec::new(),
        parts: Vec::new(),
        nodes: 0,
    };
    let scene = document
        .default_scene()
        .or_else(|| document.scenes().next());
    let scene = scene.ok_or_else(|| FormatError::field(origin, "scene", "none"))?;
    for node in scene.nodes() {
        file.node(&node, &Matrix4::identity(), 0)?;
    }
    if file.vertices.len() > MAX_VERTICES {
        return Err(FormatError::field(
            origin,
            "meshes",
            format!("more than {MAX_VERTICES} vertices"),
        ));
    }
    if file.faces.is_empty() {
        return Err(FormatError::field(origin, "meshes", "no triangles"));
    }
    let SceneReader {
        vertices,
        faces,
        mut uv,
        parts,
        ..
    } = file;
    if uv.len() != vertices.len() {
        uv.clear();
    }
    let mesh = TriMesh::new(vertices, faces)
        .map_err(|e| FormatError::field(origin, "mesh", e.to_string()))?;
    Ok(GltfModel { mesh, uv, parts })
}

/// Checks the lengths of header and chunks against the number of bytes.
fn check_container(bytes: &[u8], origin: &Path) -> Result<(), FormatError> {
    if !bytes.starts_with(b"glTF") {
        return Ok(());
    }
    let word = |at: usize| {
        bytes
            .get(at..at + 4)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
    };
    let cut = |field: &str| {
        FormatError::field(
            origin,
            field,
            "longer than the file: it is cut short or damaged",
        )
    };
    let total = word(8).ok_or_else(|| cut("header"))?;
    if total > bytes.len() || total < 20 {
        return Err(cut("header length"));
    }
    let mut at = 12;
    while at < total {
        let length = word(at).ok_or_else(|| cut("chunk"))?;
        at = at.saturating_add(8).saturating_add(length);
        if at > total {
            return Err(cut("chunk length"));
        }
    }
    Ok(())
}

/// Checks that the accessor of every POSITION exists: the gltf crate indexes it unchecked.
fn check_positions(bytes: &[u8], origin: &Path) -> Result<(), FormatError> {
    let text = match bytes.get(12..16) {
        Some(n) if bytes.starts_with(b"glTF") => {
            let end = 20 + u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize;
            bytes.get(20..end).unwrap_or_default()
        }
        _ => bytes,
    };
    let root: serde_json::Value = serde_json::from_slice(text)
        .map_err(|e| FormatError::field(origin, "json", e.to_string()))?;
    let list = |v: &serde_json::Value, key: &str| {
        v.get(key)
            .and_then(|l| l.as_array())
            .cloned()
            .unwrap_or_default()
    };
    let accessors = list(&root, "accessors").len() as u64;
    for (m, mesh) in list(&root, "meshes").iter().enumerate() {
        for (k, p) in list(mesh, "primitives").iter().enumerate() {
            let position = p
                .get("attributes")
                .and_then(|a| a.get("POSITION"))
                .and_then(|i| i.as_u64());
            if let Some(i) = position.filter(|i| *i >= accessors) {
                let why = format!("accessor {i} of {accessors} does not exist");
                return Err(FormatError::field(
                    origin,
                    format!("mesh {m}, primitive {k}: POSITION"),
                    why,
                ));
            }
        }
    }
    Ok(())
}

/// Bytes of a data URI, or of a file in the folder of `origin`.
fn external(uri: &str, origin: &Path, field: &str) -> Result<Vec<u8>, FormatError> {
    if let Some(data) = uri.strip_prefix("data:") {
        let text = data.split_once(";base64,").map(|d| d.1);
        let bytes = text.and_then(base64);
        return bytes
            .ok_or_else(|| FormatError::field(origin, field, "a data URI that is no base64"));
    }
    let relative = Path::new(uri);
    if !relative
        .components()
        .all(|c| matches!(c, Component::Normal(_)))
    {
        return Err(FormatError::field(
            origin,
            field,
            format!("`{uri}` leads out of the folder"),
        ));
    }
    read_limited(&origin.with_file_name("").join(relative), MAX_BYTES)
}

/// Decodes base64 (RFC 4648, section 4).
fn base64(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut have) = (0u32, 0);
    for c in text.trim_end_matches('=').bytes() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        have += 6;
        if have >= 8 {
            have -= 8;
            out.push((bits >> have) as u8);
            bits &= (1 << have) - 1;
        }
    }
    Some(out)
}

impl SceneReader<'_> {
    /// Adds a node and its children; `above` is the transform of the parent.
    fn node(
        &mut self,
        node: &Node<'_>,
        above: &Matrix4<f32>,
        depth: usize,
    ) -> Result<(), FormatError> {
        self.nodes += 1;
        if depth > MAX_DEPTH || self.nodes > MAX_NODES || self.vertices.len() > MAX_VERTICES {
            return Err(FormatError::field(
                self.path,
                format!("node {}", node.index()),
                "the scene is too deep or large",
            ));
        }
        let here = above * Matrix4::from(node.transform().matrix());
        if let Some(mesh) = node.mesh() {
            for (k, p) in mesh.primitives().enumerate() {
                if self.vertices.len() > MAX_VERTICES {
                    break;
                }
                let name = mesh
                    .name()
                    .map_or_else(|| format!("mesh {}", mesh.index()), str::to_owned);
                if p.mode() == Mode::Triangles {
                    self.primitive(&name, k, &p, &here)?;
                }
            }
        }
        for child in node.children() {
            self.node(&child, &here, depth + 1)?;
        }
        Ok(())
    }

    /// Adds primitive `k` of mesh `name` under the transform `place`.
    fn primitive(
        &mut self,
        name: &str,
        k: usize,
        p: &Primitive<'_>,
        place: &Matrix4<f32>,
    ) -> Result<(), FormatError> {
        let path = self.path;
        let fault = |field: &str, why: String| {
            FormatError::field(path, format!("{name}, primitive {k}: {field}"), why)
        };
        let positions = p
            .get(&Semantic::Positions)
            .ok_or_else(|| fault("POSITION", "missing".into()))?;
        let positions: Vec<[f32; 3]> = self
            .floats(&positions)
            .map_err(|why| fault("POSITION", why))?;
        let vertices: Vec<P3> = positions
            .into_iter()
            .map(|v| place.transform_point(&P3::from(v)))
            .collect();
        let uv = match p.get(&Semantic::TexCoords(0)) {
            Some(a) if a.data_type() == DataType::F32 => {
                self.floats(&a).map_err(|why| fault("TEXCOORD_0", why))?
            }
            _ => Vec::new(),
        };
        if !uv.is_empty() && uv.len() != vertices.len() {
            return Err(fault(
                "TEXCOORD_0",
                format!("{} for {} vertices", uv.len(), vertices.len()),
            ));
        }
        let corners: Vec<u32> = match p.indices() {
            Some(a) => self.indices(&a).map_err(|why| fault("indices", why))?,
            None => (0..vertices.len() as u32).collect(),
        };
        if !corners.len().is_multiple_of(3) {
            return Err(fault(
                "indices",
                format!("{} do not make triangles", corners.len()),
            ));
        }
        let faces: Vec<Face> = corners
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]])
            .collect();
        // Checked alone first, so that an error names the primitive's own face and vertex.
        let mesh = TriMesh::new(vertices, faces).map_err(|e| fault("mesh", e.to_string()))?;
        let (base, first) = (self.vertices.len() as u32, self.faces.len());
        self.vertices.extend(mesh.vertices());
        self.faces
            .extend(mesh.faces().iter().map(|f| f.map(|i| i + base)));
        self.uv.extend(uv);
        let material = p.material();
        self.parts.push(GltfPart {
            name: name.to_owned(),
            faces: first..self.faces.len(),
            color: material.pbr_metallic_roughness().base_color_factor(),
            double_sided: material.double_sided(),
        });
        Ok(())
    }

    /// Bytes of each element of an accessor.
    fn elements<'s>(&'s self, a: &Accessor<'_>, size: usize) -> Result<Vec<&'s [u8]>, String> {
        if a.sparse().is_some() {
            return Err("sparse accessors are not supported; export without them".into());
        }
        let view = a.view().ok_or("no buffer view")?;
        let stride = view.stride().unwrap_or(size).max(size);
        let buffer = self
            .buffers
            .get(view.buffer().index())
            .ok_or("no such buffer")?;
        let end = view
            .offset()
            .checked_add(view.length())
            .filter(|e| *e <= buffer.len());
        let data = &buffer[view.offset().min(buffer.len())
            ..end.ok_or("the buffer view is longer than its buffer")?];
        let data = data
            .get(a.offset()..)
            .ok_or("it starts beyond its buffer view")?;
        let need = a
            .count()
            .checked_sub(1)
            .and_then(|n| n.checked_mul(stride))
            .and_then(|n| n.checked_add(size));
        match need {
            None => Ok(Vec::new()),
            Some(need) if need > data.len() => Err(format!(
                "{} elements are more than its buffer view holds",
                a.count()
            )),
            Some(_) => Ok((0..a.count())
                .map(|i| &data[i * stride..i * stride + size])
                .collect()),
        }
    }
    fn floats<const N: usize>(&self, a: &Accessor<'_>) -> Result<Vec<[f32; N]>, String> {
        if a.data_type() != DataType::F32 || a.dimensions().multiplicity() != N {
            return Err(format!(
                "{:?} of {:?}, expected {N} floats",
                a.dimensions(),
                a.data_type()
            ));
        }
        let float = |e: &[u8], k: usize| {
            f32::from_le_bytes([e[4 * k], e[4 * k + 1], e[4 * k + 2], e[4 * k + 3]])
        };
        Ok(self
            .elements(a, 4 * N)?
            .into_iter()
            .map(|e| std::array::from_fn(|k| float(e, k)))
            .collect())
    }
    fn indices(&self, a: &Accessor<'_>) -> Result<Vec<u32>, String> {
        if a.dimensions() != Dimensions::Scalar {
            return Err("expected scalars".into());
        }
        Ok(match a.data_type() {
            DataType::U8 => self
                .elements(a, 1)?
                .into_iter()
                .map(|e| u32::from(e[0]))
                .collect(),
            DataType::U16 => self
                .elements(a, 2)?
                .into_iter()
                .map(|e| u16::from_le_bytes([e[0], e[1]]).into())
                .collect(),
            DataType::U32 => self
                .elements(a, 4)?
                .into_iter()
                .map(|e| u32::from_le_bytes([e[0], e[1], e[2], e[3]]))
                .collect(),
            other => return Err(format!("{other:?}, expected unsigned integers")),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_matches_the_vectors_of_rfc_4648() {
        for (text, want) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYmFy", "foobar"),
        ] {
            assert_eq!(base64(text).as_deref(), Some(want.as_bytes()));
        }
        assert_eq!(base64("Zm9*"), None);
    }
}
