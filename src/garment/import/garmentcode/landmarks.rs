//! Names of the edges that placement asks for: shoulders, crotch, inseam, crown; and the edges that hold a garment.

use super::figure::DrawnPanel;
use super::region::CoveredPart;
use super::shoulders::shoulder_seams;
use crate::{Anchor, Panel, Placement};
use std::collections::BTreeMap;
use tryon_formats::garmentcode::RawPattern;
use tryon_geometry::mesh::UnionFind;

/// Landmark name of each panel's raw edges.
pub(super) fn names(
    panels: &[DrawnPanel<'_>],
    regions: &[CoveredPart],
) -> BTreeMap<(usize, usize), String> {
    let mut out = BTreeMap::new();
    let mut count = vec![0usize; panels.len()];
    for (k, e) in shoulder_seams(panels, regions) {
        out.insert((k, e), numbered("shoulder", count[k]));
        count[k] += 1;
    }
    for (k, p) in panels.iter().enumerate() {
        match regions[k] {
            CoveredPart::Head(side) => {
                let crown = p
                    .neighbours
                    .iter()
                    .filter(|n| matches!(regions[n.panel], CoveredPart::Head(s) if s != side));
                for (i, n) in crown.enumerate() {
                    out.insert((k, n.edge), format!("crown_{i}"));
                }
            }
            CoveredPart::Leg(_) => {
                let named = leg_edges(panels, regions, k).into_iter().flatten();
                out.extend(named.map(|(e, name)| ((k, e), name.to_owned())));
            }
            _ => {}
        }
    }
    out
}

/// Lowest edge towards the other leg, and highest inner one towards the panel behind or before it; none without the former.
fn leg_edges(
    panels: &[DrawnPanel<'_>],
    regions: &[CoveredPart],
    k: usize,
) -> [Option<(usize, &'static str)>; 2] {
    let p = &panels[k];
    let by_height = |a: &usize, b: &usize| p.middle(*a).y.total_cmp(&p.middle(*b).y);
    let is_other_leg = |r: CoveredPart| matches!(r, CoveredPart::Leg(_)) && r != regions[k];
    let crotch = p
        .neighbours
        .iter()
        .filter(|n| is_other_leg(regions[n.panel]));
    let Some(crotch) = crotch.map(|n| n.edge).min_by(by_height) else {
        return [None, None];
    };
    let inner = p.neighbours.iter().filter(|n| {
        regions[n.panel] == regions[k]
            && panels[n.panel].is_in_front() != p.is_in_front()
            && p.middle(n.edge).x.abs() < p.centre.x.abs()
    });
    let inseam = inner.map(|n| n.edge).max_by(by_height);
    [Some((crotch, "crotch")), inseam.map(|e| (e, "inseam"))]
}

fn numbered(name: &str, k: usize) -> String {
    if k == 0 {
        name.to_owned()
    } else {
        format!("{name}_{k}")
    }
}

/// The anchor of a pattern: front shoulder seams, or the highest ring of free edges, which is tied around the body.
pub(super) fn anchor(
    raw: &RawPattern,
    drawn: &[DrawnPanel<'_>],
    panels: &[Panel],
    edge_names: &[Vec<Option<String>>],
) -> Anchor {
    let is_shoulder = |name: &str| name.starts_with("shoulder");
    let fronts = panels
        .iter()
        .filter(|p| p.placement == Placement::TrunkFront);
    let shoulders: Vec<[String; 2]> = fronts
        .flat_map(|p| {
            let named = p.edges.iter().filter(|e| is_shoulder(&e.name));
            named.map(|e| [p.name.clone(), e.name.clone()])
        })
        .collect();
    let is_skirt = |p: &Panel| matches!(p.placement, Placement::SkirtFront | Placement::SkirtBack);
    let is_dress = panels.iter().any(is_skirt);
    if !shoulders.is_empty() {
        return Anchor {
            name: "shoulders".into(),
            edges: shoulders,
            // A skirt would pull a wide neckline off the shoulders.
            strength: if is_dress { 1.0 } else { 0.5 },
        };
    }
    let named = |(p, e): (usize, usize)| Some([panels[p].name.clone(), edge_names[p][e].clone()?]);
    let trunk = panels.iter().any(|p| p.placement == Placement::TrunkFront);
    Anchor {
        name: if trunk { "chest" } else { "waist" }.into(),
        edges: highest_ring(raw, drawn)
            .into_iter()
            .filter_map(named)
            .collect(),
        strength: 1.0,
    }
}

/// Free edges of the highest of the garment's openings.
fn highest_ring(raw: &RawPattern, drawn: &[DrawnPanel<'_>]) -> Vec<(usize, usize)> {
    let mut first = vec![0];
    for p in &raw.panels {
        first.push(first[first.len() - 1] + p.vertices.len());
    }
    let mut corners = UnionFind::new(first[first.len() - 1]);
    let ends = |(p, e): (usize, usize)| raw.panels[p].edges[e].ends.map(|v| (first[p] + v) as u32);
    for s in &raw.stitches {
        let ([a, b], [c, d]) = (ends(s.sides[0]), ends(s.sides[1]));
        let (c, d) = if s.wrong_side { (d, c) } else { (c, d) };
        corners.join(a, d);
        corners.join(b, c);
    }
    let mut free = Vec::new();
    for (k, p) in raw.panels.iter().enumerate() {
        let sewn = |e: usize| drawn[k].neighbours.iter().any(|n| n.edge == e);
        free.extend((0..p.edges.len()).filter(|e| !sewn(*e)).map(|e| (k, e)));
    }
    for e in &free {
        let [a, b] = ends(*e);
        corners.join(a, b);
    }
    let (ring_of, _) = corners.number();
    let mut rings: BTreeMap<u32, Vec<(usize, usize)>> = BTreeMap::new();
    for e in free {
        rings
            .entry(ring_of[ends(e)[0] as usize])
            .or_default()
            .push(e);
    }
    let height = |r: &Vec<(usize, usize)>| {
        r.iter().map(|(p, e)| drawn[*p].middle(*e).y).sum::<f64>() / r.len() as f64
    };
    let highest = rings
        .into_values()
        .max_by(|a, b| height(a).total_cmp(&height(b)));
    highest.unwrap_or_default()
}
