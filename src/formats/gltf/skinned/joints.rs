//! Joint nodes with their inverse bind matrices, and the skinning attributes of vertices.

use super::super::document::GlbDocument;
use super::scene::GlbJoint;
use nalgebra::Translation3;
use serde_json::{Value, json};

/// Component type of bytes.
const UNSIGNED_BYTE: u32 = 5121;

/// Adds joint nodes in the rest pose and their skin; returns the skin. The node of joint `j` is node `j`.
///
/// Nodes have translations relative to the parent and no rotation. So the inverse bind matrix is T(−p) about the rest
/// position p, and a local rotation R moves vertices by T(p) R T(−p).
pub(super) fn add_skin(document: &mut GlbDocument, joints: &[GlbJoint<'_>]) -> usize {
    for (j, joint) in joints.iter().enumerate() {
        let offset = joint
            .parent
            .map_or(joint.rest.coords, |p| joint.rest - joints[p].rest);
        let children: Vec<usize> = (j + 1..joints.len())
            .filter(|&c| joints[c].parent == Some(j))
            .collect();
        let offset: [f32; 3] = offset.cast::<f32>().into();
        let mut node = json!({"name": joint.name, "translation": offset});
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        match joint.parent {
            None => {
                document.root(node);
            }
            Some(_) => document.nodes.push(node),
        }
    }

    let matrices = joints.iter().map(|joint| {
        let inverse = Translation3::from(-joint.rest.coords).to_homogeneous();
        // Columns, as in glTF.
        std::array::from_fn::<f32, 16, _>(|k| inverse[k] as f32)
    });
    let matrices = document.vectors("MAT4", matrices, false);
    let nodes: Vec<usize> = (0..joints.len()).collect();
    let skin = json!({"joints": nodes, "skeleton": 0, "inverseBindMatrices": matrices});
    document.skins.push(skin);
    document.skins.len() - 1
}

/// Adds `JOINTS_0` and `WEIGHTS_0` to the attributes of a primitive.
pub(super) fn add_influences(
    document: &mut GlbDocument,
    joints: &[[u8; 4]],
    weights: &[[f32; 4]],
    attributes: &mut Value,
) {
    let rows = joints.iter().zip(weights);
    let (joints, weights): (Vec<_>, Vec<_>) = rows.map(|(j, w)| influences(*j, *w)).unzip();
    let kind = json!({"componentType": UNSIGNED_BYTE});
    attributes["JOINTS_0"] = json!(document.integers(joints.into_iter(), kind));
    attributes["WEIGHTS_0"] = json!(document.vectors("VEC4", weights.into_iter(), true));
}

/// Skinning weights of one vertex in the form of glTF 2.0, section 3.7.3.3.
///
/// No joint appears twice, entries without weight name joint 0, and the weights sum to one.
pub(super) fn influences(joints: [u8; 4], weights: [f32; 4]) -> ([u8; 4], [f32; 4]) {
    let (mut kept, mut sums, mut count) = ([0u8; 4], [0.0f64; 4], 0);
    for (joint, weight) in joints.into_iter().zip(weights) {
        if weight <= 0.0 {
            continue;
        }
        match kept[..count].iter().position(|k| *k == joint) {
            Some(k) => sums[k] += f64::from(weight),
            None => {
                (kept[count], sums[count]) = (joint, f64::from(weight));
                count += 1;
            }
        }
    }

    let total: f64 = sums.iter().sum();
    let mut out = sums.map(|s| (s / total) as f32);
    // The largest weight takes the rounding of the others.
    let largest = (0..4).fold(0, |best, k| if out[k] > out[best] { k } else { best });
    let others: f64 = (0..4)
        .filter(|k| *k != largest)
        .map(|k| f64::from(out[k]))
        .sum();
    out[largest] = (1.0 - others) as f32;
    (kept, out)
}
