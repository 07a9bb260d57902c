//! Binary glTF under construction: the binary chunk and the JSON objects that describe it.

use super::srgb::linear;
use crate::FormatError;
use serde_json::{Value, json};
use std::path::Path;
use tryon_geometry::mesh::Face;

/// Component type of 32-bit floats.
const FLOAT: u32 = 5126;
/// Component type of 32-bit unsigned integers.
const UNSIGNED: u32 = 5125;
/// Buffer view target of vertex attributes.
const VERTEX_BUFFER: u32 = 34_962;
/// Buffer view target of vertex indices.
const INDEX_BUFFER: u32 = 34_963;

/// Objects of a glTF file, each in a list of its kind; other objects refer to them by index.
#[derive(Default)]
pub(super) struct GlbDocument {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    materials: Vec<Value>,
    images: Vec<Value>,
    textures: Vec<Value>,
    roots: Vec<usize>,
    /// Nodes; [`GlbDocument::root`] also places a node in the scene.
    pub(super) nodes: Vec<Value>,
    /// Meshes.
    pub(super) meshes: Vec<Value>,
    /// Skins.
    pub(super) skins: Vec<Value>,
    /// Animations.
    pub(super) animations: Vec<Value>,
}

impl GlbDocument {
    /// Adds a buffer view, padded to 4 bytes, so that the next one is aligned for any element.
    fn view(&mut self, data: &[u8], target: Option<u32>) -> usize {
        let mut view =
            json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": data.len()});
        if let Some(t) = target {
            view["target"] = json!(t);
        }
        self.bytes.extend_from_slice(data);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Adds an accessor with a buffer view of its own.
    fn accessor(&mut self, data: &[u8], target: Option<u32>, mut accessor: Value) -> usize {
        accessor["bufferView"] = json!(self.view(data, target));
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds rows of floats of accessor type `kind` with their bounds; `is_attribute` if vertices use them.
    pub(super) fn vectors<const N: usize>(
        &mut self,
        kind: &str,
        rows: impl Iterator<Item = [f32; N]>,
        is_attribute: bool,
    ) -> usize {
        let (mut data, mut count) = (Vec::new(), 0usize);
        let (mut lo, mut hi) = ([f32::INFINITY; N], [f32::NEG_INFINITY; N]);
        for row in rows {
            for (k, x) in row.iter().enumerate() {
                lo[k] = lo[k].min(*x);
                hi[k] = hi[k].max(*x);
                data.extend(x.to_le_bytes());
            }
            count += 1;
        }
        let accessor = json!({
            "componentType": FLOAT, "type": kind, "count": count,
            "min": lo.as_slice(), "max": hi.as_slice(),
        });
        self.accessor(&data, is_attribute.then_some(VERTEX_BUFFER), accessor)
    }

    /// Adds a vertex attribute of four unsigned integers, `B` bytes a vertex.
    /// `accessor` holds its component type and flags.
    pub(super) fn integers<const B: usize>(
        &mut self,
        rows: impl ExactSizeIterator<Item = [u8; B]>,
        mut accessor: Value,
    ) -> usize {
        accessor["type"] = json!("VEC4");
        accessor["count"] = json!(rows.len());
        let data: Vec<u8> = rows.flatten().collect();
        self.accessor(&data, Some(VERTEX_BUFFER), accessor)
    }

    /// Adds the vertex indices of triangles.
    pub(super) fn triangles(&mut self, faces: &[Face]) -> usize {
        let corners = faces.iter().flatten();
        let data: Vec<u8> = corners.flat_map(|i| i.to_le_bytes()).collect();
        let count = 3 * faces.len();
        let accessor = json!({"componentType": UNSIGNED, "type": "SCALAR", "count": count});
        self.accessor(&data, Some(INDEX_BUFFER), accessor)
    }

    /// Adds a texture of an image file, with bilinear samples and repetition.
    pub(super) fn texture(&mut self, file: &[u8], mime: &str) -> usize {
        let view = self.view(file, None);
        self.textures.push(json!({"source": self.images.len()}));
        self.images
            .push(json!({"bufferView": view, "mimeType": mime}));
        self.textures.len() - 1
    }

    /// Adds a rough, double-sided material; base colour in sRGB, times a texture.
    pub(super) fn material(&mut self, name: &str, color: [u8; 3], texture: Option<usize>) -> usize {
        let [r, g, b] = color.map(|c| linear(f32::from(c) / 255.0));
        let mut surface = json!({
            "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9,
        });
        if let Some(index) = texture {
            surface["baseColorTexture"] = json!({"index": index});
        }
        self.materials
            .push(json!({"name": name, "doubleSided": true, "pbrMetallicRoughness": surface}));
        self.materials.len() - 1
    }

    /// Adds a node at the root of the scene.
    pub(super) fn root(&mut self, node: Value) -> usize {
        self.roots.push(self.nodes.len());
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// Bytes of the `.glb` file.
    ///
    /// # Errors
    /// When the file would be 4 GiB or longer, which its header cannot hold.
    pub(super) fn finish(self, origin: &Path) -> Result<Vec<u8>, FormatError> {
        let mut root = json!({
            "asset": {"version": "2.0", "generator": concat!("tryon ", env!("CARGO_PKG_VERSION"))},
            "scene": 0,
            "scenes": [{"nodes": self.roots}],
            "nodes": self.nodes, "meshes": self.meshes, "materials": self.materials,
            "accessors": self.accessors, "bufferViews": self.views,
            "buffers": [{"byteLength": self.bytes.len()}],
        });
        // Empty lists are invalid.
        let lists = [
            ("skins", self.skins),
            ("animations", self.animations),
            ("images", self.images),
            ("textures", self.textures),
        ];
        for (key, list) in lists {
            if !list.is_empty() {
                root[key] = json!(list);
            }
        }
        container(&root.to_string(), self.bytes)
            .ok_or_else(|| FormatError::field(origin, "header", "the file exceeds 4 GiB"))
    }
}

/// GLB container: header, JSON chunk padded with spaces, binary chunk padded with zeros.
fn container(json: &str, mut binary: Vec<u8>) -> Option<Vec<u8>> {
    let mut text = json.as_bytes().to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total = 12 + 8 + text.len() + 8 + binary.len();
    let mut out = Vec::with_capacity(total);
    out.extend(b"glTF");
    out.extend(2u32.to_le_bytes());
    out.extend(u32::try_from(total).ok()?.to_le_bytes());
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &binary)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    Some(out)
}
