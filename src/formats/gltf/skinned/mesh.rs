//! Skinned mesh with vertex colours and morph targets.

use super::super::document::GlbDocument;
use super::super::srgb::linear;
use super::super::surface::normals;
use super::joints::add_influences;
use super::scene::SkinnedMesh;
use serde_json::{Value, json};
use tryon_geometry::math::P3;

/// Component type of 16-bit unsigned integers.
const UNSIGNED_SHORT: u32 = 5123;

/// Adds a mesh and its node, which is bound to a skin; returns the node.
pub(super) fn add_mesh(document: &mut GlbDocument, m: &SkinnedMesh<'_>, skin: usize) -> usize {
    let name = m.surface.name;
    let mut primitive = m.surface.primitive(document);
    if !m.colors.is_empty() {
        primitive["attributes"]["COLOR_0"] = json!(add_colors(document, m.colors));
    }
    add_influences(document, m.joints, m.weights, &mut primitive["attributes"]);

    let mut mesh = json!({"name": name});
    if !m.targets.is_empty() {
        primitive["targets"] = morph_targets(document, m);
        let names: Vec<&str> = m.targets.iter().map(|t| t.name).collect();
        mesh["extras"] = json!({"targetNames": names});
        mesh["weights"] = match m.target_weights {
            [] => json!(vec![0.0; m.targets.len()]),
            weights => json!(weights),
        };
    }
    mesh["primitives"] = json!([primitive]);
    document.meshes.push(mesh);
    document.root(json!({"name": name, "mesh": document.meshes.len() - 1, "skin": skin}))
}

/// Adds linear colours with opacity one, 16 bits a channel: 8 would merge dark shades of sRGB.
fn add_colors(document: &mut GlbDocument, colors: &[[u8; 3]]) -> usize {
    let channel = |c: u8| (linear(f32::from(c) / 255.0) * 65_535.0).round() as u16;
    let rows = colors.iter().map(|c| {
        let [r, g, b] = c.map(|c| channel(c).to_le_bytes());
        [r[0], r[1], g[0], g[1], b[0], b[1], 255, 255]
    });
    let kind = json!({"componentType": UNSIGNED_SHORT, "normalized": true});
    document.integers(rows, kind)
}

/// Displacements of positions, and of normals at weight one, without which wrinkles would not be shaded.
fn morph_targets(document: &mut GlbDocument, m: &SkinnedMesh<'_>) -> Value {
    let (vertices, faces) = (m.surface.vertices, m.surface.faces);
    let rest = normals(vertices, faces);
    let mut moved: Vec<P3> = Vec::new();
    let mut targets = Vec::new();
    for target in m.targets {
        moved.clear();
        moved.extend(vertices.iter().zip(target.deltas).map(|(p, d)| p + d));
        let normals = normals(&moved, faces);
        let turned = normals.iter().zip(&rest).map(|(n, r)| (n - r).into());

        let positions = target.deltas.iter().map(|d| (*d).into());
        let position = document.vectors("VEC3", positions, true);
        let normal = document.vectors("VEC3", turned, true);
        targets.push(json!({"POSITION": position, "NORMAL": normal}));
    }
    json!(targets)
}
