//! Vertices of a glTF primitive at rest: morph weights, then skin (glTF 2.0, sections 3.7.2.2 and 3.7.3).

use super::file::GltfFile;
use ::gltf::{Node, Primitive, Semantic, Skin};
use nalgebra::Matrix4;
use tryon_geometry::math::{P3, V3};

/// Most sets of four joints a vertex.
const MOST_SETS: u32 = 4;

/// Adds the displacements of the morph targets, by their weights.
///
/// # Errors
/// The target at fault.
pub(super) fn morph(
    file: &GltfFile,
    p: &Primitive<'_>,
    weights: &[f32],
    vertices: &mut [P3],
) -> Result<(), String> {
    let targets = p.morph_targets().zip(weights).enumerate();
    for (k, (target, weight)) in targets.filter(|(_, (_, w))| **w != 0.0) {
        let Some(a) = target.positions() else {
            continue;
        };
        let fault = |why: String| format!("morph target {k}: {why}");
        let deltas = file.accessors.floats::<3>(&a).map_err(fault)?;
        if deltas.len() != vertices.len() {
            let (n, m) = (deltas.len(), vertices.len());
            return Err(fault(format!("{n} rows for {m} vertices")));
        }
        for (v, d) in vertices.iter_mut().zip(deltas) {
            *v += V3::from(d) * *weight;
        }
    }
    Ok(())
}

/// Weights of the morph targets of a node's mesh: its own, or those of the mesh.
pub(super) fn morph_weights(node: &Node<'_>) -> Vec<f32> {
    let of_mesh = || node.mesh().and_then(|m| m.weights().map(<[f32]>::to_vec));
    let own = node.weights().map(<[f32]>::to_vec);
    own.or_else(of_mesh).unwrap_or_default()
}

/// Skin matrix of each joint: its transform at rest after the inverse of that in the bind pose. `world` are the transforms of
/// the nodes.
///
/// # Errors
/// Matrices that are fewer than the joints.
pub(super) fn skin_matrices(
    file: &GltfFile,
    skin: &Skin<'_>,
    world: &[Matrix4<f32>],
) -> Result<Vec<Matrix4<f32>>, String> {
    let inverse = match skin.inverse_bind_matrices() {
        Some(a) => Some(file.accessors.floats::<16>(&a)?),
        None => None,
    };
    let joints = skin.joints().enumerate();
    joints
        .map(|(j, node)| {
            let placed = world.get(node.index()).copied();
            let placed = placed.unwrap_or_else(Matrix4::identity);
            let Some(inverse) = &inverse else {
                return Ok(placed);
            };
            let columns = inverse.get(j).ok_or_else(|| {
                format!("{} inverse bind matrices for more joints", inverse.len())
            })?;
            Ok(placed * Matrix4::from_column_slice(columns))
        })
        .collect()
}

/// Moves vertices by the weighted mean of their joints' matrices.
///
/// # Errors
/// Joints or weights of another number than vertices, or a joint that does not exist.
pub(super) fn skinned(
    file: &GltfFile,
    p: &Primitive<'_>,
    matrices: &[Matrix4<f32>],
    vertices: &mut [P3],
) -> Result<(), String> {
    let mut sums = vec![Matrix4::zeros(); vertices.len()];
    let mut totals = vec![0.0f32; vertices.len()];
    for set in 0..MOST_SETS {
        let joints = p.get(&Semantic::Joints(set));
        let weights = p.get(&Semantic::Weights(set));
        let (Some(joints), Some(weights)) = (joints, weights) else {
            break;
        };
        let joints = file.accessors.floats::<4>(&joints)?;
        let weights = file.accessors.normalized::<4>(&weights)?;
        if joints.len() != vertices.len() || weights.len() != vertices.len() {
            let (j, w, v) = (joints.len(), weights.len(), vertices.len());
            return Err(format!(
                "{j} rows of joints and {w} of weights for {v} vertices"
            ));
        }
        for (i, (joints, weights)) in joints.iter().zip(&weights).enumerate() {
            for (joint, weight) in joints.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
                let matrix = matrices.get(*joint as usize);
                let matrix = matrix.ok_or_else(|| {
                    format!(
                        "vertex {i}: joint {joint} of {} does not exist",
                        matrices.len()
                    )
                })?;
                sums[i] += matrix * *weight;
                totals[i] += weight;
            }
        }
    }
    for (v, (sum, total)) in vertices.iter_mut().zip(sums.iter().zip(totals)) {
        // A vertex without weights stays where it is.
        if total > 0.0 {
            *v = (sum / total).transform_point(v);
        }
    }
    Ok(())
}
