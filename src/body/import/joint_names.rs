//! Names of a body's joints by their part in it: SMPL's for the joints of a person, derived ones for the rest.

use super::file_error::BodyFileError;
use crate::human_joints::{HumanJoints, JointTree, LimbChain, SideBasis, SideEvidence};
use nalgebra::Point3;
use std::collections::BTreeMap;
use tryon_formats::npz::SmplArrays;

/// A body's joints in a person.
pub(super) struct NamedJoints {
    pub(super) joints: HumanJoints,
    pub(super) basis: SideBasis,
    /// Shape `[joints]`.
    pub(super) names: Vec<String>,
    /// Joints of trunk and limbs.
    pub(super) parts: Vec<usize>,
}

/// Mean evidence of left and right from the joints at rest, and from the skin of the feet beyond the ankles.
fn evidence(
    found: &HumanJoints,
    arrays: &SmplArrays,
    places: &[Point3<f64>],
    tree: &JointTree<'_>,
) -> f64 {
    let mut joints = SideEvidence::default();
    joints.add(found, places);
    // Feet as if their centroids were joints: for trees that end at the ankle.
    let feet = found
        .legs
        .each_ref()
        .map(|leg| centroid_below(leg.end(), arrays, tree));
    let [Some(left), Some(right)] = feet else {
        return joints.mean();
    };
    let up = places[found.arms[0].root()] - places[found.legs[0].root()];
    let lateral = places[found.legs[0].root()] - places[found.legs[1].root()];
    let Some(ahead) = lateral.cross(&up).try_normalize(0.0) else {
        return joints.mean();
    };
    let length = up.norm().max(f64::MIN_POSITIVE);
    let skin = (left - places[found.legs[0].end()]) + (right - places[found.legs[1].end()]);
    joints.mean() + skin.dot(&ahead) / length
}

/// Centroid of the skin that a joint and those below it move most.
pub(super) fn centroid_below(
    joint: usize,
    arrays: &SmplArrays,
    tree: &JointTree<'_>,
) -> Option<Point3<f64>> {
    let j = arrays.parents.len();
    let is_below: Vec<bool> = (0..j).map(|k| tree.is_above(joint, k)).collect();
    let mut sum = nalgebra::Vector3::zeros();
    let mut count = 0usize;
    for (vertex, row) in arrays.vertices.iter().zip(arrays.weights.chunks_exact(j)) {
        let share: f32 = row
            .iter()
            .zip(&is_below)
            .filter(|(_, b)| **b)
            .map(|(w, _)| *w)
            .sum();
        if share > 0.5 {
            sum += nalgebra::Vector3::from(vertex.map(f64::from));
            count += 1;
        }
    }
    (count > 0).then(|| Point3::from(sum / count as f64))
}

/// Finds the joints of a person in a body, and names them.
///
/// # Errors
/// The limb that is missing.
pub(super) fn name_joints(arrays: &SmplArrays) -> Result<NamedJoints, BodyFileError> {
    let places: Vec<Point3<f64>> = arrays.joints.iter().map(|p| Point3::from(*p)).collect();
    let tree = JointTree {
        parents: &arrays.parents,
        places: &places,
        names: &arrays.joint_names,
    };
    let found = HumanJoints::find(&tree).map_err(BodyFileError::Joints)?;
    let seen = evidence(&found, arrays, &places, &tree);
    let (joints, basis) = found.sided(&tree, seen).map_err(BodyFileError::Sides)?;
    let mut roles = roles(&joints, &tree);
    let parts = roles.keys().copied().collect();
    head_parts(&mut roles, &joints, &tree);
    Ok(NamedJoints {
        names: rest(&roles, &tree),
        parts,
        joints,
        basis,
    })
}

/// Names of the joints of trunk and limbs.
fn roles(joints: &HumanJoints, tree: &JointTree<'_>) -> BTreeMap<usize, String> {
    let mut roles: BTreeMap<usize, String> = BTreeMap::new();
    for (side, leg, arm) in [
        ("left", &joints.legs[0], &joints.arms[0]),
        ("right", &joints.legs[1], &joints.arms[1]),
    ] {
        limb(&mut roles, side, leg, ["hip", "knee", "ankle"]);
        limb(&mut roles, side, arm, ["shoulder", "elbow", "wrist"]);
        if let Some(collar) = arm.before_root().last() {
            roles.insert(*collar, format!("{side}_collar"));
        }
        if let Some(ball) = leg.after_end() {
            roles.insert(ball, format!("{side}_foot"));
        }
        // SMPL's hand is one joint without fingers.
        let children =
            |joint| (0..tree.parents.len()).filter(move |k| tree.parents[*k] == Some(joint));
        let mut hands = children(arm.end());
        if let (Some(hand), None) = (hands.next(), hands.next())
            && children(hand).next().is_none()
        {
            roles.insert(hand, format!("{side}_hand"));
        }
    }
    for (k, joint) in joints.spine.iter().enumerate() {
        roles
            .entry(*joint)
            .or_insert_with(|| format!("spine{}", k + 1));
    }
    let trunk = [
        (joints.neck, "neck"),
        (joints.head, "head"),
        (Some(0), "pelvis"),
    ];
    for (joint, name) in trunk {
        if let Some(joint) = joint {
            roles.insert(joint, name.to_owned());
        }
    }
    roles
}

fn limb(roles: &mut BTreeMap<usize, String>, side: &str, limb: &LimbChain, names: [&str; 3]) {
    for (joint, name) in [limb.root(), limb.hinge(), limb.end()]
        .into_iter()
        .zip(names)
    {
        roles.insert(joint, format!("{side}_{name}"));
    }
}

/// Jaw and eyes: children of the head without children, one in the sagittal plane and one on each side of it.
fn head_parts(roles: &mut BTreeMap<usize, String>, joints: &HumanJoints, tree: &JointTree<'_>) {
    let Some(head) = joints.head else { return };
    let left = tree.places[joints.arms[0].root()] - tree.places[joints.arms[1].root()];
    let Some(left) = left.try_normalize(0.0) else {
        return;
    };
    let children: Vec<usize> = (0..tree.parents.len())
        .filter(|k| tree.parents[*k] == Some(head))
        .collect();
    let [a, b, c] = children[..] else { return };
    let lateral = |joint: usize| (tree.places[joint] - tree.places[head]).dot(&left);
    let mut sorted = [a, b, c];
    sorted.sort_by(|p, q| lateral(*p).total_cmp(&lateral(*q)));
    let [right, middle, left] = sorted;
    let reach = lateral(left).min(-lateral(right));
    if reach > 0.0 && lateral(middle).abs() < 0.3 * reach {
        roles.insert(middle, "jaw".into());
        roles.insert(left, "left_eye".into());
        roles.insert(right, "right_eye".into());
    }
}

/// Names of all joints: those without a role take the name above them and a number.
fn rest(roles: &BTreeMap<usize, String>, tree: &JointTree<'_>) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut stems: Vec<String> = Vec::new();
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for joint in 0..tree.parents.len() {
        if let Some(name) = roles.get(&joint) {
            stems.push(name.clone());
            out.push(name.clone());
            continue;
        }
        let above = tree.parents[joint].map_or("pelvis", |p| stems[p].as_str());
        let stem = match above.split_once('_') {
            Some((side, "wrist")) => format!("{side}_finger"),
            Some((side, "ankle" | "foot")) => format!("{side}_toe"),
            _ => above.to_owned(),
        };
        let count = counts.entry(stem.clone()).or_default();
        *count += 1;
        out.push(format!("{stem}_{count}"));
        stems.push(stem);
    }
    out
}
