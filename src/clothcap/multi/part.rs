//! Parts of the multi-cloth template: faces of one garment, the body vertex of each of its vertices, and its boundary rings.

use crate::segment::{BodyRegion, Labelling, Slot};
use crate::topology::{ClothTemplate, LegTopology};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use tryon_body::Template;
use tryon_body::parts::BodySide;
use tryon_geometry::mesh::{Face, UnionFind, boundary_edges, boundary_loops};

/// Least number of faces of a piece; smaller ones are errors of the labels.
pub(super) const LEAST_FACES: usize = 40;
/// Least number of vertices of a ring that gets a name; smaller ones are holes.
const LEAST_RING: usize = 12;

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
        let template = cloth.template();
        let regions = BodyRegion::of_vertices(template);
        let garments = labelling.slots.iter().enumerate();
        let parts = garments
            .filter(|(_, s)| s.is_garment())
            .filter_map(|(l, slot)| {
                let own: Vec<bool> = labelling
                    .labels
                    .iter()
                    .map(|x| usize::from(*x) == l)
                    .collect();
                let hidden: Vec<bool> = (0..own.len())
                    .map(|v| !own[v] && *slot == Slot::Under && is_under(labelling, &regions, v))
                    .collect();
                ClothPart::new(cloth, (l as u8, *slot), &own, &hidden)
            });
        Self {
            parts: parts.collect(),
            legs: cloth.legs(),
        }
    }
}

/// A node under the outer garment that the inner one is completed with: torso only.
fn is_under(labelling: &Labelling, regions: &[BodyRegion], v: usize) -> bool {
    let outer = labelling.slots[usize::from(labelling.labels[v])];
    outer == Slot::Top && (regions[v].is_torso() || regions[v] == BodyRegion::UpperArm)
}

impl ClothPart {
    /// Part of the nodes `own` and `hidden`; `None` if too small.
    fn new(
        cloth: &ClothTemplate,
        (label, slot): (u8, Slot),
        own: &[bool],
        hidden: &[bool],
    ) -> Option<Self> {
        let within = |v: u32| own[v as usize] || hidden[v as usize];
        // A face with two corners within belongs to the part: its third corner joins it, so that parts meet without gaps.
        let template = cloth.template();
        let mut faces: Vec<Face> = template
            .mesh()
            .faces()
            .iter()
            .filter(|f| f.iter().filter(|v| within(**v)).count() >= 2)
            .copied()
            .collect();
        drop_small_pieces(&mut faces, LEAST_FACES);
        drop_fans(&mut faces);
        if faces.len() < LEAST_FACES {
            return None;
        }
        let nodes: BTreeSet<u32> = faces.iter().flatten().copied().collect();
        let nodes: Vec<u32> = nodes.into_iter().collect();
        let mut index = vec![u32::MAX; own.len()];
        for (i, v) in nodes.iter().enumerate() {
            index[*v as usize] = i as u32;
        }
        let local: Vec<Face> = faces.iter().map(|f| f.map(|v| index[v as usize])).collect();
        let rings = boundary_loops(&local)
            .into_iter()
            .map(|vertices| Ring {
                name: ring_name(template, &nodes, &vertices),
                vertices,
            })
            .collect();
        let mut part = Self {
            slot,
            label,
            hidden: nodes.iter().map(|v| hidden[*v as usize]).collect(),
            below: nodes.iter().map(|v| cloth.body_vertex(*v)).collect(),
            nodes,
            faces: local,
            rings,
        };
        part.tell_apart();
        Some(part)
    }

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
        let pinched: BTreeSet<u32> = out
            .into_iter()
            .filter(|(_, n)| *n > 1)
            .map(|(v, _)| v)
            .collect();
        if pinched.is_empty() {
            return;
        }
        faces.retain(|f| !f.iter().any(|v| pinched.contains(v)));
    }
}

/// Name of a ring by the body below it.
fn ring_name(template: &Template, nodes: &[u32], ring: &[u32]) -> String {
    use BodyRegion::*;
    if ring.len() < LEAST_RING {
        return "hole".into();
    }
    let regions = BodyRegion::of_vertices(template);
    let mut counts: BTreeMap<u8, usize> = BTreeMap::new();
    let (mut left, mut right) = (0, 0);
    for v in ring {
        let node = nodes[*v as usize] as usize;
        *counts.entry(regions[node] as u8).or_default() += 1;
        match template.parts().side(template.weights().dominant(node)) {
            Some(BodySide::Left) => left += 1,
            Some(BodySide::Right) => right += 1,
            None => {}
        }
    }
    let most = counts.iter().max_by_key(|(_, n)| **n).map(|(r, _)| *r);
    let share = |all: &[BodyRegion]| {
        let own = all.iter().filter_map(|r| counts.get(&(*r as u8)));
        own.sum::<usize>() as f64 / ring.len() as f64
    };
    let one_side = left.max(right) as f64 > 0.8 * ring.len() as f64;
    let side = if left > right { "left" } else { "right" };
    let region = [
        Head, Neck, Chest, Abdomen, Pelvis, UpperArm, Forearm, Hand, Thigh, Shin, Foot,
    ]
    .into_iter()
    .find(|r| Some(*r as u8) == most);
    match region {
        Some(Head | Neck) => "neck".into(),
        Some(UpperArm | Forearm | Hand) if one_side => format!("{side}_sleeve"),
        Some(Chest) if one_side && share(&[UpperArm, Chest]) > 0.8 => format!("{side}_armhole"),
        Some(Chest) => "neck".into(),
        Some(Abdomen | Pelvis) => "waist".into(),
        Some(Thigh | Shin | Foot) if one_side => format!("{side}_leg"),
        _ => "hem".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    /// Labels by region: shirt on torso and upper arms, trousers on hips and thighs.
    fn labelling(template: &Template) -> Labelling {
        let labels = BodyRegion::of_vertices(template)
            .iter()
            .map(|r| match r {
                BodyRegion::Chest | BodyRegion::Abdomen | BodyRegion::UpperArm => 2,
                BodyRegion::Pelvis | BodyRegion::Thigh => 3,
                _ => 0,
            })
            .collect();
        Labelling {
            slots: vec![Slot::Skin, Slot::Hair, Slot::Top, Slot::Bottom],
            labels,
            appearances: vec![None; 4],
            energy: 0.0,
            is_top_long: false,
        }
    }

    #[test]
    fn rings_are_found_and_named() {
        let template = embedded::template();
        let cloth = ClothTemplate::new(&template, LegTopology::Apart).expect("the body itself");
        let cloth = MultiCloth::new(&cloth, &labelling(&template));
        let names = |k: usize| {
            let mut all: Vec<&str> = cloth.parts[k]
                .rings
                .iter()
                .map(|r| r.name.as_str())
                .collect();
            all.sort_unstable();
            all
        };
        assert_eq!(names(0), ["left_sleeve", "neck", "right_sleeve", "waist"]);
        assert_eq!(names(1), ["left_leg", "right_leg", "waist"]);
    }

    #[test]
    fn boundary_vertices_lie_on_one_ring_once() {
        let template = embedded::template();
        let cloth = ClothTemplate::new(&template, LegTopology::Apart).expect("the body itself");
        for part in MultiCloth::new(&cloth, &labelling(&template)).parts {
            let mut all: Vec<u32> = part.rings.iter().flat_map(|r| r.vertices.clone()).collect();
            let count = all.len();
            assert_eq!(count, boundary_edges(&part.faces).len());
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), count);
        }
    }
}
