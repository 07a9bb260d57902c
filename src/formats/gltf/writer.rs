//! Binary glTF from meshes: one buffer, one node a mesh, morph targets for motion.

use super::GlbMesh;
use crate::formats::FormatError;
use crate::math::{P3, V3};
use crate::mesh::face_normal;
use serde_json::{Value, json};
use std::path::Path;

const FLOAT: u32 = 5126;
const UNSIGNED: u32 = 5125;
const VERTEX_BUFFER: u32 = 34_962;
const INDEX_BUFFER: u32 = 34_963;

/// The binary chunk and what describes it.
#[derive(Default)]
struct Builder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Builder {
    fn add(&mut self, data: &[u8], target: Option<u32>, mut accessor: Value) -> usize {
        // Everything is made of 4-byte values, so offsets stay aligned.
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
}

/// Area-weighted vertex normals; up where a vertex has no face.
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

/// Meshes to the bytes of a `.glb`. `frames` holds positions of each mesh at later moments, shape
/// `[meshes][frames][vertices]`, `frame_seconds` apart; empty (or too short) for meshes that stand still.
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
    let (mut nodes, mut out, mut materials, mut animations) = (vec![], vec![], vec![], vec![]);
    for (i, m) in meshes.iter().enumerate() {
        let vertices = m.vertices;
        let frames = frames.get(i).map_or(&[][..], Vec::as_slice);
        let finite = |f: &[P3]| f.iter().all(|p| p.iter().all(|c| c.is_finite()));
        let fault = |field: &str, why: String| {
            FormatError::field(origin, format!("mesh `{}`.{field}", m.name), why)
        };
        let n = vertices.len();
        if m.faces.is_empty() {
            return Err(fault("faces", "none".into()));
        }
        if let Some((f, k)) = m
            .faces
            .iter()
            .enumerate()
            .find_map(|(i, f)| f.iter().find(|k| **k as usize >= n).map(|k| (i, k)))
        {
            return Err(fault(
                "faces",
                format!("face {f}: vertex index {k} is out of range ({n} vertices)"),
            ));
        }
        if !finite(vertices) {
            return Err(fault("vertices", "a position is not finite".into()));
        }
        if !m.uv.is_empty() && m.uv.len() != n {
            return Err(fault("uv", format!("{} for {n} vertices", m.uv.len())));
        }
        if let Some(k) = frames.iter().position(|f| f.len() != n || !finite(f)) {
            return Err(fault(
                "frames",
                format!("frame {k} needs {n} finite positions"),
            ));
        }
        let position = b.vectors("VEC3", vertices.iter().map(|p| [p.x, p.y, p.z]), true);
        let normal = b.vectors(
            "VEC3",
            normals(m).into_iter().map(|n| [n.x, n.y, n.z]),
            true,
        );
        let mut attributes = json!({"POSITION": position, "NORMAL": normal});
        if !m.uv.is_empty() {
            attributes["TEXCOORD_0"] = json!(b.vectors("VEC2", m.uv.iter().copied(), true));
        }
        let indices: Vec<u8> = m
            .faces
            .iter()
            .flatten()
            .flat_map(|i| i.to_le_bytes())
            .collect();
        let count = 3 * m.faces.len();
        let accessor = json!({"componentType": UNSIGNED, "type": "SCALAR", "count": count});
        let indices = b.add(&indices, Some(INDEX_BUFFER), accessor);
        let mut primitive = json!({"attributes": attributes, "indices": indices, "material": i});
        let mut mesh = json!({"name": m.name});
        if !frames.is_empty() {
            // One target a frame, each fully on at its time: positions between frames are blended linearly.
            let off = |f: &Vec<P3>| {
                let rows: Vec<[f32; 3]> = f
                    .iter()
                    .zip(vertices)
                    .map(|(p, q)| (p - q).into())
                    .collect();
                b.vectors("VEC3", rows.into_iter(), true)
            };
            let targets: Vec<usize> = frames.iter().map(off).collect();
            primitive["targets"] = targets.iter().map(|t| json!({"POSITION": t})).collect();
            let k = frames.len();
            mesh["weights"] = json!(vec![0.0; k]);
            let times = b.vectors("SCALAR", (0..k).map(|t| [t as f32 * frame_seconds]), false);
            let weights = b.vectors(
                "SCALAR",
                (0..k * k).map(|w| [f32::from(u8::from(w / k == w % k))]),
                false,
            );
            animations.push(json!({
                "name": format!("{} motion", m.name),
                "samplers": [{"input": times, "output": weights, "interpolation": "LINEAR"}],
                "channels": [{"sampler": 0, "target": {"node": i, "path": "weights"}}],
            }));
        }
        mesh["primitives"] = json!([primitive]);
        out.push(mesh);
        nodes.push(json!({"name": m.name, "mesh": i}));
        materials.push(json!({
            "name": m.name,
            "doubleSided": true,
            "pbrMetallicRoughness": {"baseColorFactor": [linear(m.color[0]), linear(m.color[1]), linear(m.color[2]), 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9},
        }));
    }
    let mut root = json!({
        "asset": {"version": "2.0", "generator": concat!("tryon ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
        "nodes": nodes, "meshes": out, "materials": materials,
        "accessors": b.accessors, "bufferViews": b.views, "buffers": [{"byteLength": b.bytes.len()}],
    });
    if !animations.is_empty() {
        root["animations"] = json!(animations);
    }
    Ok(container(&root.to_string(), b.bytes))
}

/// Header, JSON chunk padded with spaces, binary chunk padded with zeros.
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

/// Writes a `.glb` of meshes that stand still.
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
