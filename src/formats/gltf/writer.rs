//! Binary glTF from meshes: one buffer, one node a mesh, morph targets for motion.

use crate::formats::FormatError;
use crate::math::{P3, V3};
use crate::mesh::{Face, face_normal};
use serde_json::{Value, json};
use std::path::Path;

const FLOAT: u32 = 5126;
const UNSIGNED: u32 = 5125;
const VERTEX_BUFFER: u32 = 34_962;
const INDEX_BUFFER: u32 = 34_963;

/// The binary chunk and the JSON objects that describe it.
#[derive(Default)]
struct Builder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    materials: Vec<Value>,
    animations: Vec<Value>,
}

impl Builder {
    fn add(&mut self, data: &[u8], target: Option<u32>, mut accessor: Value) -> usize {
        // All data are 4-byte values, so offsets stay aligned.
        let mut view =
            json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": data.len()});
        if let Some(t) = target {
            view["target"] = json!(t);
        }
        self.bytes.extend_from_slice(data);
        accessor["bufferView"] = json!(self.views.len());
        self.views.push(view);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
    fn vectors<const N: usize>(
        &mut self,
        kind: &str,
        rows: impl Iterator<Item = [f32; N]>,
        target: bool,
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
        self.add(&data, target.then_some(VERTEX_BUFFER), accessor)
    }

    /// Adds a mesh with its node, material and motion.
    fn mesh(&mut self, m: &GlbMesh<'_>, frames: &[Vec<P3>], frame_seconds: f32) {
        let index = self.meshes.len();
        let position = self.vectors("VEC3", m.vertices.iter().map(|p| [p.x, p.y, p.z]), true);
        let normals = normals(m).into_iter().map(|n| [n.x, n.y, n.z]);
        let normal = self.vectors("VEC3", normals, true);
        let mut attributes = json!({"POSITION": position, "NORMAL": normal});
        if !m.uv.is_empty() {
            attributes["TEXCOORD_0"] = json!(self.vectors("VEC2", m.uv.iter().copied(), true));
        }
        let indices = m.faces.iter().flatten().flat_map(|i| i.to_le_bytes());
        let indices: Vec<u8> = indices.collect();
        let count = 3 * m.faces.len();
        let accessor = json!({"componentType": UNSIGNED, "type": "SCALAR", "count": count});
        let indices = self.add(&indices, Some(INDEX_BUFFER), accessor);
        let mut primitive =
            json!({"attributes": attributes, "indices": indices, "material": index});
        let mut mesh = json!({"name": m.name});
        if !frames.is_empty() {
            primitive["targets"] = self.morph_targets(m, frames);
            mesh["weights"] = json!(vec![0.0; frames.len()]);
            self.animation(m.name, frames.len(), frame_seconds);
        }
        mesh["primitives"] = json!([primitive]);
        self.meshes.push(mesh);
        self.nodes.push(json!({"name": m.name, "mesh": index}));
        let [r, g, b] = m.color.map(linear);
        self.materials.push(json!({
            "name": m.name,
            "doubleSided": true,
            "pbrMetallicRoughness": {"baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9},
        }));
    }
    /// One morph target a frame: displacements from the mesh.
    fn morph_targets(&mut self, m: &GlbMesh<'_>, frames: &[Vec<P3>]) -> Value {
        let target = |f: &Vec<P3>| {
            let rows = f.iter().zip(m.vertices).map(|(p, q)| (p - q).into());
            json!({"POSITION": self.vectors("VEC3", rows, true)})
        };
        frames.iter().map(target).collect()
    }
    /// Animation of the next node: each target has weight one at its time; positions are linear in between.
    fn animation(&mut self, name: &str, frames: usize, frame_seconds: f32) {
        let times = (0..frames).map(|t| [t as f32 * frame_seconds]);
        let times = self.vectors("SCALAR", times, false);
        let weights = (0..frames * frames).map(|w| [f32::from(u8::from(w / frames == w % frames))]);
        let weights = self.vectors("SCALAR", weights, false);
        self.animations.push(json!({
            "name": format!("{name} motion"),
            "samplers": [{"input": times, "output": weights, "interpolation": "LINEAR"}],
            "channels": [{"sampler": 0, "target": {"node": self.nodes.len(), "path": "weights"}}],
        }));
    }
    fn finish(self) -> Vec<u8> {
        let mut root = json!({
            "asset": {"version": "2.0", "generator": concat!("tryon ", env!("CARGO_PKG_VERSION"))},
            "scene": 0,
            "scenes": [{"nodes": (0..self.nodes.len()).collect::<Vec<_>>()}],
            "nodes": self.nodes, "meshes": self.meshes, "materials": self.materials,
            "accessors": self.accessors, "bufferViews": self.views,
            "buffers": [{"byteLength": self.bytes.len()}],
        });
        if !self.animations.is_empty() {
            root["animations"] = json!(self.animations);
        }
        container(&root.to_string(), self.bytes)
    }
}

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

/// Area-weighted vertex normals; +y for a vertex without a face.
fn normals(m: &GlbMesh<'_>) -> Vec<V3> {
    let mut out = vec![V3::zeros(); m.vertices.len()];
    for f in m.faces {
        let n = face_normal(m.vertices, f);
        f.iter().for_each(|&i| out[i as usize] += n);
    }
    out.iter()
        .map(|n| n.try_normalize(0.0).unwrap_or(V3::y()))
        .collect()
}

/// sRGB to linear (IEC 61966-2-1).
fn linear(c: u8) -> f32 {
    let s = f32::from(c) / 255.0;
    if s <= 0.040_45 {
        s / 12.92
    } else {
        ((s + 0.055) / 1.055).powf(2.4)
    }
}

/// Encodes meshes as a `.glb`. `frames` holds the positions of each mesh over time, shape `[meshes][frames][vertices]`,
/// `frame_seconds` apart; empty (or too short) for static meshes.
///
/// # Errors
/// Names the mesh: no faces, an index out of range, a position that is not finite, or texture coordinates or frames
/// of another length than its vertices.
pub fn encode_glb(
    meshes: &[GlbMesh<'_>],
    frames: &[Vec<Vec<P3>>],
    frame_seconds: f32,
    origin: &Path,
) -> Result<Vec<u8>, FormatError> {
    let mut b = Builder::default();
    for (i, m) in meshes.iter().enumerate() {
        let frames = frames.get(i).map_or(&[][..], Vec::as_slice);
        check(m, frames, origin)?;
        b.mesh(m, frames, frame_seconds);
    }
    Ok(b.finish())
}

/// Checks indices, positions and lengths of a mesh and its frames.
fn check(m: &GlbMesh<'_>, frames: &[Vec<P3>], origin: &Path) -> Result<(), FormatError> {
    let finite = |f: &[P3]| f.iter().all(|p| p.iter().all(|c| c.is_finite()));
    let fault = |field: &str, why: String| {
        let field = format!("mesh `{}`.{field}", m.name);
        Err(FormatError::field(origin, field, why))
    };
    let n = m.vertices.len();
    if m.faces.is_empty() {
        return fault("faces", "none".into());
    }
    let corners = m.faces.iter().enumerate();
    let mut corners = corners.flat_map(|(f, corners)| corners.iter().map(move |k| (f, *k)));
    if let Some((f, k)) = corners.find(|(_, k)| *k as usize >= n) {
        let why = format!("face {f}: vertex index {k} is out of range ({n} vertices)");
        return fault("faces", why);
    }
    if !finite(m.vertices) {
        return fault("vertices", "a position is not finite".into());
    }
    if !m.uv.is_empty() && m.uv.len() != n {
        return fault("uv", format!("{} for {n} vertices", m.uv.len()));
    }
    if let Some(k) = frames.iter().position(|f| f.len() != n || !finite(f)) {
        return fault("frames", format!("frame {k} needs {n} finite positions"));
    }
    Ok(())
}

/// GLB container: header, JSON chunk padded with spaces, binary chunk padded with zeros.
fn container(json: &str, mut binary: Vec<u8>) -> Vec<u8> {
    let mut text = json.as_bytes().to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total = 12 + 8 + text.len() + 8 + binary.len();
    let mut out = Vec::with_capacity(total);
    out.extend(b"glTF");
    out.extend(2u32.to_le_bytes());
    out.extend((total as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &binary)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

/// Writes a `.glb` of static meshes.
///
/// # Errors
/// As [`encode_glb`], or when the file cannot be written.
pub fn write_glb(path: &Path, meshes: &[GlbMesh<'_>]) -> Result<(), FormatError> {
    write_glb_motion(path, meshes, &[], 1.0)
}

/// Writes a `.glb` with motion: frames as in [`encode_glb`].
///
/// # Errors
/// As [`encode_glb`], or when the file cannot be written.
pub fn write_glb_motion(
    path: &Path,
    meshes: &[GlbMesh<'_>],
    frames: &[Vec<Vec<P3>>],
    frame_seconds: f32,
) -> Result<(), FormatError> {
    std::fs::write(path, encode_glb(meshes, frames, frame_seconds, path)?)
        .map_err(|e| FormatError::io(path, e))
}
