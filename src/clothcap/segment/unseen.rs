//! Parts of the body that a scan shows: garments end where nothing of the body is seen.

use super::labelling::Labelling;
use super::node_colors::NodeColors;
use super::prior::BodyRegion;
use crate::align::SurfaceMatch;
use crate::settings::LabelSettings;
use std::collections::BTreeMap;
use tryon_body::Template;
use tryon_geometry::math::V3;

/// Nodes in slices of their bone that the scan shows, or next to one that it shows; shape `[nodes]`.
pub fn seen_slices(template: &Template, nodes: &NodeColors) -> Vec<bool> {
    let settings = &nodes.settings.unseen;
    let slices = bone_slices(template, settings.slice);
    let mut counts: BTreeMap<(usize, i32), (usize, usize)> = BTreeMap::new();
    for (v, slice) in slices.iter().enumerate() {
        let count = counts.entry(*slice).or_default();
        count.0 += usize::from(!nodes.points.row(v).is_empty());
        count.1 += 1;
    }
    let is_seen = |slice: &(usize, i32)| {
        let count = counts.get(slice);
        count.is_some_and(|(seen, all)| *seen as f64 >= settings.slice_share * *all as f64)
    };
    let near = |(bone, k): &(usize, i32)| (k - 1..=k + 1).any(|k| is_seen(&(*bone, k)));
    slices.iter().map(near).collect()
}

/// Regions of the body of which hardly a vertex has a point; `template` is that of the matches' faces.
pub fn unseen_regions(
    template: &Template,
    matches: &[SurfaceMatch],
    settings: &LabelSettings,
) -> Vec<BodyRegion> {
    let faces = template.mesh().faces();
    let regions = BodyRegion::of_vertices(template);
    let mut seen = vec![false; regions.len()];
    let shows = |m: &&SurfaceMatch| m.weight > 0.0 && m.distance < settings.near;
    for m in matches.iter().filter(shows) {
        for v in faces[m.face as usize] {
            seen[v as usize] = true;
        }
    }
    let share = |region: BodyRegion| {
        let own = || regions.iter().zip(&seen).filter(|(r, _)| **r == region);
        own().filter(|(_, s)| **s).count() as f64 / own().count().max(1) as f64
    };
    let all = BodyRegion::ALL.into_iter();
    all.filter(|r| share(*r) < settings.unseen.region_share)
        .collect()
}

/// Bone of each node, and slice across it, `height` metres thick; shape `[nodes]`.
pub(crate) fn bone_slices(template: &Template, height: f32) -> Vec<(usize, i32)> {
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
            (bone, (along / height).floor() as i32)
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
