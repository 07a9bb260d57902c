//! Labels carried from the template to the scan, with boundaries drawn along the scan's own colours.

use super::color_mixture::hsv_cone;
use super::labelling::Labelling;
use super::prior::IMPOSSIBLE;
use crate::clothcap::CaptureError;
use crate::clothcap::align::SurfaceMatch;
use crate::clothcap::face_edges::edges;
use crate::clothcap::mrf::{ExpansionConfig, MrfModel};
use crate::clothcap::scan::{BodyScan, mean_spacing};
use crate::mesh::{Csr, Face};
use crate::spatial::HashGrid;

/// Width of the band about the template's boundaries in which the scan decides, rings of nodes.
const BAND: u32 = 3;
/// Cost of another label than the template's within the band, nats a ring.
const PULL: f32 = 0.7;
/// Cost of a label change between neighbours of equal colour, nats, and the share left across a change of colour.
const SMOOTHNESS: [f32; 2] = [2.0, 0.2];
/// Difference of colours that halves the rest.
const CONTRAST: f32 = 0.08;
/// Point whose label is not open.
const NO_ROW: u32 = u32::MAX;
/// Neighbours of a point of a cloud.
const NEIGHBOURS: usize = 6;

/// Labels the points of a scan; `topology` gives the nodes' neighbours. Shape `[points]`.
///
/// # Errors
/// [`CaptureError::Solve`] for an energy that is not finite.
pub fn label_scan(
    scan: &BodyScan,
    matches: &[SurfaceMatch],
    (faces, neighbours): (&[Face], &Csr),
    labelling: &Labelling,
) -> Result<Vec<u8>, CaptureError> {
    let node_of = |m: &SurfaceMatch| faces[m.face as usize][m.nearest_corner()] as usize;
    let start = matches
        .iter()
        .map(|m| u32::from(labelling.labels[node_of(m)]));
    let mut labels: Vec<u32> = start.collect();
    if scan.colors.is_empty() {
        return Ok(labels.iter().map(|l| *l as u8).collect());
    }
    let depth = label_depths(neighbours, labelling);
    let count = labelling.slots.len();
    let of_node = |i: usize| {
        let node = node_of(&matches[i]);
        &depth[node * count..(node + 1) * count]
    };
    let is_open = |i: &usize| of_node(*i).iter().filter(|d| **d <= BAND).count() > 1;
    let open: Vec<usize> = (0..matches.len()).filter(is_open).collect();
    let colors: Vec<_> = scan.colors.iter().map(|c| hsv_cone(*c)).collect();
    let mut unary = Vec::with_capacity(open.len() * count);
    for &i in &open {
        for (appearance, rings) in labelling.appearances.iter().zip(of_node(i)) {
            let color = appearance
                .as_ref()
                .map_or(0.0, |a| a.cost(&colors[i]) as f32);
            // Rings from the node to the nearest one of this label.
            let pull = match *rings {
                0 => 0.0,
                d if d <= BAND => PULL * d as f32,
                _ => IMPOSSIBLE,
            };
            unary.push(color + pull);
        }
    }
    let weight = |[a, b]: [u32; 2]| {
        let d = (colors[a as usize] - colors[b as usize]).norm() as f32 / CONTRAST;
        let [full, rest] = SMOOTHNESS;
        full * (rest + (1.0 - rest) / (1.0 + d * d))
    };
    let mut row_of = vec![NO_ROW; labels.len()];
    for (row, i) in open.iter().enumerate() {
        row_of[*i] = row as u32;
    }
    let (mut edges, mut weights) = (Vec::new(), Vec::new());
    for edge in scan_edges(scan) {
        let [a, b] = edge.map(|v| row_of[v as usize]);
        match (a != NO_ROW, b != NO_ROW) {
            (true, true) => {
                edges.push([a, b]);
                weights.push(weight(edge));
            }
            // Points of one possible label are theirs whatever their neighbours are.
            (true, false) => hold(
                &mut unary,
                (a, count),
                labels[edge[1] as usize],
                weight(edge),
            ),
            (false, true) => hold(
                &mut unary,
                (b, count),
                labels[edge[0] as usize],
                weight(edge),
            ),
            (false, false) => (),
        }
    }
    let model = MrfModel {
        edges: &edges,
        weights: &weights,
    };
    let mut found: Vec<u32> = open.iter().map(|i| labels[*i]).collect();
    model
        .expand(&unary, &mut found, &ExpansionConfig::default())
        .map_err(|e| CaptureError::Solve {
            stage: "labels of the scan",
            why: e.to_string(),
        })?;
    for (i, label) in open.iter().zip(found) {
        labels[*i] = label;
    }
    Ok(labels.iter().map(|l| *l as u8).collect())
}

/// Adds the cost of other labels than that of a fixed neighbour.
fn hold(unary: &mut [f32], (row, count): (u32, usize), label: u32, weight: f32) {
    let row = row as usize * count;
    for (l, cost) in unary[row..row + count].iter_mut().enumerate() {
        if l != label as usize {
            *cost += weight;
        }
    }
}

/// Rings from each node to the nearest one of each label, at most one beyond [`BAND`]; shape `[nodes, labels]`.
fn label_depths(neighbours: &Csr, labelling: &Labelling) -> Vec<u32> {
    let count = labelling.slots.len();
    let nodes = labelling.labels.len();
    let mut depth = vec![BAND + 1; nodes * count];
    for (v, l) in labelling.labels.iter().enumerate() {
        depth[v * count + usize::from(*l)] = 0;
    }
    for ring in 1..=BAND {
        for v in 0..nodes {
            for l in 0..count {
                let reached = |w: &u32| depth[*w as usize * count + l] == ring - 1;
                if depth[v * count + l] > ring && neighbours.row(v).iter().any(reached) {
                    depth[v * count + l] = ring;
                }
            }
        }
    }
    depth
}

/// Edges of the faces, or between near points of a cloud; each once.
fn scan_edges(scan: &BodyScan) -> Vec<[u32; 2]> {
    if !scan.faces.is_empty() {
        return edges(&scan.faces);
    }
    let reach = 2.0 * mean_spacing(&scan.points);
    let mut grid = HashGrid::default();
    // Searches reach half a cell, and may find a point twice.
    grid.fill(&scan.points, 2.0 * reach);
    let mut out = Vec::new();
    for (i, p) in scan.points.iter().enumerate() {
        let i = i as u32;
        let mut near = Vec::new();
        grid.within(p, reach, |j, d| {
            if j != i {
                near.push((d, j));
            }
        });
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.dedup();
        let some = near.iter().take(NEIGHBOURS);
        out.extend(some.map(|(_, j)| [*j.min(&i), *j.max(&i)]));
    }
    out.sort_unstable();
    out.dedup();
    out
}
