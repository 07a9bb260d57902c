//! Slices of limbs and trunk that a scan shows: garments end where nothing of the body is seen.

use super::labelling::Labelling;
use super::node_colors::NodeColors;
use crate::body::Template;
use crate::math::V3;
use std::collections::BTreeMap;

/// Height of a slice across a bone, metres.
const SLICE: f32 = 0.02;
/// Share of a slice's nodes with a scan point from which it is seen: one side of a limb has a third.
const SEEN: f64 = 0.1;

/// Nodes in slices of their bone that the scan shows, or next to one that it shows; shape `[nodes]`.
pub fn seen_slices(template: &Template, nodes: &NodeColors) -> Vec<bool> {
    let slices = slices(template);
    let mut counts: BTreeMap<(usize, i32), (usize, usize)> = BTreeMap::new();
    for (v, slice) in slices.iter().enumerate() {
        let count = counts.entry(*slice).or_default();
        count.0 += usize::from(!nodes.points.row(v).is_empty());
        count.1 += 1;
    }
    let is_seen = |slice: &(usize, i32)| {
        let count = counts.get(slice);
        count.is_some_and(|(seen, all)| *seen as f64 >= SEEN * *all as f64)
    };
    let near = |(bone, k): &(usize, i32)| (k - 1..=k + 1).any(|k| is_seen(&(*bone, k)));
    slices.iter().map(near).collect()
}

/// Bone of each node, and slice across it; shape `[nodes]`.
fn slices(template: &Template) -> Vec<(usize, i32)> {
    let joints = template.skeleton().joints();
    let at = |j: usize| joints[j].rest.coords.cast::<f32>();
    let axis = |j: usize| -> V3 {
        let child = (0..joints.len()).find(|c| joints[*c].parent == Some(j));
        let along = match (child, joints[j].parent) {
            (Some(c), _) => at(c) - at(j),
            (None, Some(p)) => at(j) - at(p),
            (None, None) => V3::y(),
        };
        along.try_normalize(f32::MIN_POSITIVE).unwrap_or(V3::y())
    };
    let axes: Vec<V3> = (0..joints.len()).map(axis).collect();
    let vertices = template.mesh().vertices().iter().enumerate();
    vertices
        .map(|(v, p)| {
            let bone = template.weights().dominant(v);
            let along = axes[bone].dot(&(p.coords - at(bone)));
            (bone, (along / SLICE).floor() as i32)
        })
        .collect()
}

impl Labelling {
    /// Takes the garments off nodes that are not seen; shape of `seen`: `[nodes]`.
    pub fn leave_unseen(&mut self, seen: &[bool]) {
        for (label, _) in self.labels.iter_mut().zip(seen).filter(|(_, s)| !**s) {
            if self.slots[usize::from(*label)].is_garment() {
                *label = 0;
            }
        }
    }
}
