//! Labels carried from the template to the scan, with boundaries drawn along the scan's own colours.

use super::color_mixture::hsv_cone;
use super::labelling::Labelling;
use super::prior::IMPOSSIBLE;
use crate::CaptureError;
use crate::align::SurfaceMatch;
use crate::scan::BodyScan;
use nalgebra::Vector3;
use tryon_geometry::mesh::{Csr, Face};
use tryon_geometry::mrf::{ExpansionConfig, MrfModel};

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

/// Labels the points of a scan; `topology` gives the nodes' neighbours. Shape `[points]`.
///
/// # Errors
/// [`CaptureError::Solve`] for an energy that is not finite.
pub fn label_scan(
    (scan, edges): (&BodyScan, &[[u32; 2]]),
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
    let unary: Vec<f32> = open
        .iter()
        .flat_map(|i| costs(labelling, of_node(*i), &colors[*i]))
        .collect();
    let mut energy = OpenPoints::new(labels.len(), &open, unary);
    for &edge in edges {
        let d = (colors[edge[0] as usize] - colors[edge[1] as usize]).norm() as f32 / CONTRAST;
        let [full, rest] = SMOOTHNESS;
        energy.join(edge, full * (rest + (1.0 - rest) / (1.0 + d * d)), &labels);
    }
    energy.solve(&open, &mut labels)?;
    Ok(labels.iter().map(|l| *l as u8).collect())
}

/// Costs of all labels at a point: its colour, and rings from its node to the nearest one of each label.
fn costs<'a>(
    labelling: &'a Labelling,
    rings: &'a [u32],
    color: &'a Vector3<f64>,
) -> impl Iterator<Item = f32> + 'a {
    labelling
        .appearances
        .iter()
        .zip(rings)
        .map(|(look, rings)| {
            let pull = match *rings {
                0 => 0.0,
                d if d <= BAND => PULL * d as f32,
                _ => IMPOSSIBLE,
            };
            look.as_ref().map_or(0.0, |a| a.cost(color) as f32) + pull
        })
}

/// Energy of the points that may have more than one label; the others hold their neighbours.
struct OpenPoints {
    /// Row of each point of the scan, [`NO_ROW`] for one that is not open.
    row_of: Vec<u32>,
    /// Shape `[rows, labels]`.
    unary: Vec<f32>,
    labels: usize,
    edges: Vec<[u32; 2]>,
    weights: Vec<f32>,
}

impl OpenPoints {
    fn new(points: usize, open: &[usize], unary: Vec<f32>) -> Self {
        let mut row_of = vec![NO_ROW; points];
        for (row, i) in open.iter().enumerate() {
            row_of[*i] = row as u32;
        }
        Self {
            row_of,
            labels: unary.len() / open.len().max(1),
            unary,
            edges: Vec::new(),
            weights: Vec::new(),
        }
    }

    /// Adds an edge of the scan; `labels` are those of points that are not open.
    fn join(&mut self, edge: [u32; 2], weight: f32, labels: &[u32]) {
        let [p, q] = edge.map(|v| v as usize);
        match [self.row_of[p], self.row_of[q]] {
            [NO_ROW, NO_ROW] => (),
            [row, NO_ROW] => self.hold(row, labels[q], weight),
            [NO_ROW, row] => self.hold(row, labels[p], weight),
            rows => {
                self.edges.push(rows);
                self.weights.push(weight);
            }
        }
    }

    /// Adds the cost of other labels than that of a neighbour that is not open.
    fn hold(&mut self, row: u32, label: u32, weight: f32) {
        let row = row as usize * self.labels;
        for (l, cost) in self.unary[row..row + self.labels].iter_mut().enumerate() {
            if l != label as usize {
                *cost += weight;
            }
        }
    }

    fn solve(&self, open: &[usize], labels: &mut [u32]) -> Result<(), CaptureError> {
        let model = MrfModel {
            edges: &self.edges,
            weights: &self.weights,
        };
        let mut found: Vec<u32> = open.iter().map(|i| labels[*i]).collect();
        model
            .expand(&self.unary, &mut found, &ExpansionConfig::default())
            .map_err(|e| CaptureError::Solve {
                stage: "labels of the scan",
                why: e.to_string(),
            })?;
        for (i, label) in open.iter().zip(found) {
            labels[*i] = label;
        }
        Ok(())
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
