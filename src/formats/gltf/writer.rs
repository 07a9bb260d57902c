//! Binary glTF from meshes: one node a mesh, morph targets for motion.

use super::document::GlbDocument;
use super::surface::{GlbMesh, is_finite};
use crate::FormatError;
use serde_json::{Value, json};
use std::path::Path;
use tryon_geometry::math::P3;

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
    let mut document = GlbDocument::default();
    for (i, m) in meshes.iter().enumerate() {
        let frames = frames.get(i).map_or(&[][..], Vec::as_slice);
        m.check(origin)?;
        check_frames(m, frames, origin)?;
        add_mesh(&mut document, m, frames, frame_seconds);
    }
    document.finish(origin)
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

/// Checks lengths and positions of the frames of a mesh.
fn check_frames(m: &GlbMesh<'_>, frames: &[Vec<P3>], origin: &Path) -> Result<(), FormatError> {
    let n = m.vertices.len();
    match frames.iter().position(|f| f.len() != n || !is_finite(f)) {
        None => Ok(()),
        Some(k) => {
            let field = format!("mesh `{}`.frames", m.name);
            let why = format!("frame {k} needs {n} finite positions");
            Err(FormatError::field(origin, field, why))
        }
    }
}

/// Adds a mesh with its node, material and motion.
fn add_mesh(document: &mut GlbDocument, m: &GlbMesh<'_>, frames: &[Vec<P3>], frame_seconds: f32) {
    let mut primitive = m.primitive(document);
    let mut mesh = json!({"name": m.name});
    if !frames.is_empty() {
        primitive["targets"] = morph_targets(document, m, frames);
        mesh["weights"] = json!(vec![0.0; frames.len()]);
    }
    mesh["primitives"] = json!([primitive]);
    let node = document.root(json!({"name": m.name, "mesh": document.meshes.len()}));
    document.meshes.push(mesh);
    if !frames.is_empty() {
        add_animation(document, node, frames.len(), frame_seconds);
    }
}

/// One morph target a frame: displacements from the mesh.
fn morph_targets(document: &mut GlbDocument, m: &GlbMesh<'_>, frames: &[Vec<P3>]) -> Value {
    let target = |f: &Vec<P3>| {
        let rows = f.iter().zip(m.vertices).map(|(p, q)| (p - q).into());
        json!({"POSITION": document.vectors("VEC3", rows, true)})
    };
    frames.iter().map(target).collect()
}

/// Animation of a node: each target has weight one at its time; positions are linear in between.
fn add_animation(document: &mut GlbDocument, node: usize, frames: usize, frame_seconds: f32) {
    let times = (0..frames).map(|t| [t as f32 * frame_seconds]);
    let times = document.vectors("SCALAR", times, false);
    let weights = (0..frames * frames).map(|w| [f32::from(u8::from(w / frames == w % frames))]);
    let weights = document.vectors("SCALAR", weights, false);
    let name = document.nodes[node]["name"].as_str().unwrap_or_default();
    document.animations.push(json!({
        "name": format!("{name} motion"),
        "samplers": [{"input": times, "output": weights, "interpolation": "LINEAR"}],
        "channels": [{"sampler": 0, "target": {"node": node, "path": "weights"}}],
    }));
}
