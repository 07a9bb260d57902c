//! Places of glTF nodes in the scene, and of the instances of a mesh (EXT_mesh_gpu_instancing).

use super::accessor_index::accessor_at;
use super::file::GltfFile;
use ::gltf::Node;
use nalgebra::{Matrix4, Quaternion, Translation3, UnitQuaternion, Vector3};

/// Deepest scene; deeper ones are cycles.
pub(super) const MAX_DEPTH: usize = 64;
/// Extension of instances.
const INSTANCES: &str = "EXT_mesh_gpu_instancing";

/// Transform of each node in the scene at rest, by its index.
pub(super) fn world_transforms(file: &GltfFile) -> Vec<Matrix4<f32>> {
    let nodes: Vec<Node<'_>> = file.document.nodes().collect();
    let mut parent = vec![None; nodes.len()];
    for node in &nodes {
        for child in node.children() {
            parent[child.index()] = Some(node.index());
        }
    }
    let own: Vec<Matrix4<f32>> = nodes.iter().map(local).collect();
    let world = |i: usize| {
        let mut out = own[i];
        let mut at = parent[i];
        for _ in 0..MAX_DEPTH {
            let Some(above) = at else {
                break;
            };
            out = own[above] * out;
            at = parent[above];
        }
        out
    };
    (0..nodes.len()).map(world).collect()
}

/// Transform of a node relative to its parent.
pub(super) fn local(node: &Node<'_>) -> Matrix4<f32> {
    Matrix4::from(node.transform().matrix())
}

/// Nodes without a parent.
pub(super) fn roots<'d>(file: &'d GltfFile) -> Vec<Node<'d>> {
    let mut is_child = vec![false; file.document.nodes().len()];
    for child in file.document.nodes().flat_map(|n| n.children()) {
        is_child[child.index()] = true;
    }
    let nodes = file.document.nodes();
    nodes.filter(|n| !is_child[n.index()]).collect()
}

/// Transforms of the instances of a node's mesh relative to the node; one identity for a node without.
///
/// # Errors
/// The attribute at fault.
pub(super) fn instances(file: &GltfFile, node: usize) -> Result<Vec<Matrix4<f32>>, String> {
    let Some(extension) = file.extension("nodes", node, INSTANCES) else {
        return Ok(vec![Matrix4::identity()]);
    };
    let fault = |name: &str, why: String| format!("{INSTANCES}: {name}: {why}");
    let accessor = |name: &str| {
        let index = extension.get("attributes").and_then(|a| a.get(name));
        accessor_at(&file.document, index).map_err(|why| fault(name, why))
    };
    let read3 = |name: &str| {
        let rows = accessor(name)?.map(|a| file.accessors.floats::<3>(&a));
        rows.transpose().map_err(|why| fault(name, why))
    };
    let (moved, scaled) = (read3("TRANSLATION")?, read3("SCALE")?);
    let turned = accessor("ROTATION")?.map(|a| file.accessors.floats::<4>(&a));
    let turned = turned.transpose().map_err(|why| fault("ROTATION", why))?;

    let lengths = [
        moved.as_ref().map(Vec::len),
        scaled.as_ref().map(Vec::len),
        turned.as_ref().map(Vec::len),
    ];
    let mut counts = lengths.into_iter().flatten();
    let Some(count) = counts.next() else {
        return Err(fault("attributes", "none".into()));
    };
    if counts.any(|n| n != count) {
        return Err(fault(
            "attributes",
            "they have different numbers of instances".into(),
        ));
    }
    Ok((0..count)
        .map(|i| {
            let t = moved.as_ref().map_or([0.0; 3], |rows| rows[i]);
            let s = scaled.as_ref().map_or([1.0; 3], |rows| rows[i]);
            let [x, y, z, w] = turned.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |rows| rows[i]);
            let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
            Translation3::from(t).to_homogeneous()
                * turn.to_homogeneous()
                * Matrix4::new_nonuniform_scaling(&Vector3::from(s))
        })
        .collect())
}
