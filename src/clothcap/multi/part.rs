//! Parts of the multi-cloth template: faces of one garment, the body vertex of each of its vertices, and its boundary rings.

use crate::segment::{BodyRegion, Labelling, Slot};
use crate::settings::PartCutSettings;
use crate::topology::{ClothTemplate, LegTopology};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use tryon_body::parts::BodySide;
use tryon_geometry::mesh::{Face, UnionFind, boundary_edges, boundary_loops};

/// Boundary ring of a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ring {
    /// Place on the body: `neck`, `left_sleeve`, `waist`, `hem` …; `hole` for a small one.
    pub name: String,
    /// Vertices of the part in order, closed.
    pub vertices: Vec<u32>,
}

/// One garment of the template.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClothPart {
    /// Place on the body.
    pub slot: Slot,
    /// Label of it in the segmentation.
    pub label: u8,
    /// Vertex of the clothed template of each vertex, ascending.
    pub nodes: Vec<u32>,
    /// Body vertex next to each vertex.
    pub below: Vec<u32>,
    /// Triangles over the part's own vertices.
    pub faces: Vec<Face>,
    /// Boundaries.
    pub rings: Vec<Ring>,
    /// Vertices under another garment: completed from the body, no scan point is theirs.
    pub hidden: Vec<bool>,
}

/// Template in parts; part 0 of the paper, the skin, is the body itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MultiCloth {
    /// Garments, in the order of their labels.
    pub parts: Vec<ClothPart>,
    /// Course of the cloth around the legs.
    #[serde(default)]
    pub legs: LegTopology,
}

impl MultiCloth {
    /// Cuts the template along the labels of its nodes.
    pub fn new(cloth: &ClothTemplate, labelling: &Labelling) -> Self {
        let cutter = PartCutter {
            cloth,
            labelling,
            regions: BodyRegion::of_vertices(cloth.template()),
            settings: PartCutSettings::default(),
        };
        let garments = 0..labelling.slots.len();
        Self {
            parts: garments.filter_map(|label| cutter.part(label)).collect(),
            legs: cloth.legs(),
        }
    }
}

struct PartCutter<'a> {
    cloth: &'a ClothTemplate,
    labelling: &'a Labelling,
    regions: Vec<BodyRegion>,
    settings: PartCutSettings,
}

impl PartCutter<'_> {
    /// A node under the outer garment that the inner one is completed with: torso only.
    fn is_under(&self, v: usize) -> bool {
        let outer = self.labelling.slots[usize::from(self.labelling.labels[v])];
        let region = self.regions[v];
        outer == Slot::Top && (region.is_torso() || region == BodyRegion::UpperArm)
    }

    /// Part of a label; `None` for skin and hair, and if it is too small.
    fn part(&self, label: usize) -> Option<ClothPart> {
        let slot = self.labelling.slots[label];
        if !slot.is_garment() {
            return None;
        }
        let labels = &self.labelling.labels;
        let is_own = |v: usize| usize::from(labels[v]) == label;
        let is_hidden = |v| !is_own(v) && slot == Slot::Under && self.is_under(v);
        let hidden: Vec<bool> = (0..labels.len()).map(is_hidden).collect();
        let within = |v: u32| is_own(v as usize) || hidden[v as usize];
        // A face with two corners within belongs to the part: its third corner joins it, so that parts meet without gaps.
        let is_part = |f: &&Face| f.iter().filter(|v| within(**v)).count() >= 2;
        let all = self.cloth.template().mesh().faces().iter();
        let mut faces: Vec<Face> = all.filter(is_part).copied().collect();
        drop_small_pieces(&mut faces, self.settings.least_faces);
        drop_fans(&mut faces);
        if faces.len() < self.settings.least_faces {
            return None;
        }
        let (nodes, local) = compact(&faces);
        let rings = boundary_loops(&local).into_iter().map(|vertices| Ring {
            name: self.ring_name(&nodes, &vertices),
            vertices,
        });
        let mut part = ClothPart {
            slot,
            label: label as u8,
            rings: rings.collect(),
            hidden: nodes.iter().map(|v| hidden[*v as usize]).collect(),
            below: nodes.iter().map(|v| self.cloth.body_vertex(*v)).collect(),
            nodes,
            faces: local,
        };
        part.tell_apart();
        Some(part)
    }

    /// Name of a ring by the body below it.
    fn ring_name(&self, nodes: &[u32], ring: &[u32]) -> String {
        use BodyRegion::*;
        if ring.len() < self.settings.least_ring {
            return "hole".into();
        }
        let template = self.cloth.template();
        let mut counts = [0; BodyRegion::ALL.len()];
        let (mut left, mut right) = (0, 0);
        for v in ring {
            let node = nodes[*v as usize] as usize;
            counts[self.regions[node] as usize] += 1;
            match template.parts().side(template.weights().dominant(node)) {
                Some(BodySide::Left) => left += 1,
                Some(BodySide::Right) => right += 1,
                None => {}
            }
        }
        let count = |r: &BodyRegion| counts[*r as usize];
        let is_most = |n: usize| n as f64 > self.settings.one_side * ring.len() as f64;
        let one_side = is_most(left.max(right));
        let side = if left > right { "left" } else { "right" };
        // Of regions with the same count the last one in their order.
        let all = BodyRegion::ALL.into_iter();
        match all.max_by_key(|r| (count(r), *r as u8)) {
            Some(Head | Neck) => "neck".into(),
            Some(UpperArm | Forearm | Hand) if one_side => format!("{side}_sleeve"),
            Some(Chest) if one_side && is_most(count(&UpperArm) + count(&Chest)) => {
                format!("{side}_armhole")
            }
            Some(Chest) => "neck".into(),
            Some(Abdomen | Pelvis) => "waist".into(),
            Some(Thigh | Shin | Foot) if one_side => format!("{side}_leg"),
            _ => "hem".into(),
        }
    }
}

impl ClothPart {
    /// Numbers rings of the same name.
    fn tell_apart(&mut self) {
        let mut seen: BTreeMap<String, usize> = BTreeMap::new();
        for ring in &mut self.rings {
            let n = seen.entry(ring.name.clone()).or_default();
            *n += 1;
            if *n > 1 {
                ring.name = format!("{}_{n}", ring.name);
            }
        }
    }
}

/// Vertices that some faces use, ascending, and the faces over these.
pub(super) fn compact(faces: &[Face]) -> (Vec<u32>, Vec<Face>) {
    let used: BTreeSet<u32> = faces.iter().flatten().copied().collect();
    let used: Vec<u32> = used.into_iter().collect();
    let index = |v: u32| used.binary_search(&v).unwrap_or_default() as u32;
    let local = faces.iter().map(|f| f.map(index)).collect();
    (used, local)
}

/// Leaves out connected pieces with fewer than `least` faces.
pub(super) fn drop_small_pieces(faces: &mut Vec<Face>, least: usize) {
    let vertices = faces.iter().flatten().max().map_or(0, |v| *v as usize + 1);
    let mut sets = UnionFind::new(vertices);
    for f in faces.iter() {
        f[1..].iter().for_each(|v| sets.join(f[0], *v));
    }
    let mut sizes = vec![0usize; vertices];
    let roots: Vec<usize> = faces.iter().map(|f| sets.root(f[0]) as usize).collect();
    roots.iter().for_each(|r| sizes[*r] += 1);
    let mut keep = roots.iter().map(|r| sizes[*r] >= least);
    faces.retain(|_| keep.next().unwrap_or(false));
}

/// Leaves out faces at vertices where two fans of faces meet, so that every boundary vertex lies on one ring once.
pub(super) fn drop_fans(faces: &mut Vec<Face>) {
    loop {
        let mut out: BTreeMap<u32, usize> = BTreeMap::new();
        for [a, _] in boundary_edges(faces) {
            *out.entry(a).or_default() += 1;
        }
        let pinched = out.into_iter().filter(|(_, n)| *n > 1).map(|(v, _)| v);
        let pinched: BTreeSet<u32> = pinched.collect();
        if pinched.is_empty() {
            return;
        }
        faces.retain(|f| !f.iter().any(|v| pinched.contains(v)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    /// Shirt on torso and upper arms, trousers on hips and thighs.
    fn cloth() -> MultiCloth {
        let template = embedded::template();
        let label = |r: &BodyRegion| match r {
            BodyRegion::Chest | BodyRegion::Abdomen | BodyRegion::UpperArm => 2,
            BodyRegion::Pelvis | BodyRegion::Thigh => 3,
            _ => 0,
        };
        let regions = BodyRegion::of_vertices(&template);
        let labelling = Labelling {
            slots: vec![Slot::Skin, Slot::Hair, Slot::Top, Slot::Bottom],
            labels: regions.iter().map(label).collect(),
            appearances: vec![None; 4],
            energy: 0.0,
            is_top_long: false,
        };
        let surface = ClothTemplate::new(&template, LegTopology::Apart);
        MultiCloth::new(&surface.expect("the body itself"), &labelling)
    }

    #[test]
    fn rings_are_found_and_named() {
        let cloth = cloth();
        let names = |k: usize| {
            let rings = cloth.parts[k].rings.iter();
            let mut all: Vec<&str> = rings.map(|r| r.name.as_str()).collect();
            all.sort_unstable();
            all
        };
        assert_eq!(names(0), ["left_sleeve", "neck", "right_sleeve", "waist"]);
        assert_eq!(names(1), ["left_leg", "right_leg", "waist"]);
    }

    #[test]
    fn boundary_vertices_lie_on_one_ring_once() {
        for part in cloth().parts {
            let mut all: Vec<u32> = part.rings.iter().flat_map(|r| r.vertices.clone()).collect();
            let count = all.len();
            assert_eq!(count, boundary_edges(&part.faces).len());
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), count);
        }
    }
}
