//! Labels carried from the template to the scan, with boundaries drawn along the scan's own colours.

use super::color_mixture::{ColorMixture, hsv_cone};
use super::labelling::Labelling;
use super::prior::IMPOSSIBLE;
use crate::CaptureError;
use crate::align::SurfaceMatch;
use crate::scan::BodyScan;
use crate::settings::LabelSettings;
use nalgebra::Vector3;
use tryon_body::Template;
use tryon_geometry::mesh::Csr;
use tryon_geometry::mrf::{ExpansionConfig, MrfModel};

/// Point whose label is not open.
const NO_ROW: u32 = u32::MAX;

/// Scan whose labels are drawn from those of a template.
#[derive(Clone, Copy, Debug)]
pub struct ScanLabeller<'a> {
    /// Scan.
    pub scan: &'a BodyScan,
    /// Its edges.
    pub edges: &'a [[u32; 2]],
    /// Place of each point on the template.
    pub matches: &'a [SurfaceMatch],
    /// Template.
    pub template: &'a Template,
    /// Settings of the segmentation.
    pub settings: &'a LabelSettings,
}

impl ScanLabeller<'_> {
    /// Labels the points of the scan by those of the nodes. Shape `[points]`.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for an energy that is not finite.
    pub fn run(&self, labelling: &Labelling) -> Result<Vec<u8>, CaptureError> {
        let settings = &self.settings.scan;
        let faces = self.template.mesh().faces();
        let node_of = |m: &SurfaceMatch| m.nearest_vertex(faces) as usize;
        let matches = self.matches.iter();
        let start = matches.map(|m| u32::from(labelling.labels[node_of(m)]));
        let mut labels: Vec<u32> = start.collect();
        if self.scan.colors.is_empty() {
            return Ok(labels.iter().map(|l| *l as u8).collect());
        }
        let neighbours = self.template.topology().vertex_neighbours();
        let depth = label_depths(neighbours, labelling, settings.band);
        let count = labelling.slots.len();
        let of_node = |i: usize| {
            let node = node_of(&self.matches[i]);
            &depth[node * count..(node + 1) * count]
        };
        let is_near = |d: &&u32| **d <= settings.band;
        let is_open = |i: &usize| of_node(*i).iter().filter(is_near).count() > 1;
        let open: Vec<usize> = (0..labels.len()).filter(is_open).collect();
        let colors: Vec<_> = self.scan.colors.iter().map(|c| hsv_cone(*c)).collect();
        let costs = |i: &usize| self.costs(labelling, of_node(*i), &colors[*i]);
        let unary: Vec<f32> = open.iter().flat_map(costs).collect();
        let mut energy = OpenPoints::new(labels.len(), &open, unary);
        let (full, rest) = (settings.smoothness, settings.least_smoothness);
        for &edge in self.edges {
            let [a, b] = edge.map(|v| colors[v as usize]);
            let d = (a - b).norm() as f32 / settings.contrast;
            energy.join(edge, full * (rest + (1.0 - rest) / (1.0 + d * d)), &labels);
        }
        energy.solve(&open, &mut labels)?;
        Ok(labels.iter().map(|l| *l as u8).collect())
    }

    /// Costs of all labels at a point: its colour, and rings from its node to the nearest one of each label.
    fn costs(&self, labelling: &Labelling, rings: &[u32], color: &Vector3<f64>) -> Vec<f32> {
        let settings = &self.settings.scan;
        let outliers = self.settings.colors.outliers;
        let cost = |(look, rings): (&Option<ColorMixture>, &u32)| {
            let pull = match *rings {
                0 => 0.0,
                d if d <= settings.band => settings.pull * d as f32,
                _ => IMPOSSIBLE,
            };
            let look = look.as_ref();
            look.map_or(0.0, |a| a.cost(color, outliers) as f32) + pull
        };
        labelling.appearances.iter().zip(rings).map(cost).collect()
    }
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
            .map_err(|e| CaptureError::solve("labels of the scan", e))?;
        for (i, label) in open.iter().zip(found) {
            labels[*i] = label;
        }
        Ok(())
    }
}

/// Rings from each node to the nearest one of each label, at most one beyond the band; shape `[nodes, labels]`.
fn label_depths(neighbours: &Csr, labelling: &Labelling, band: u32) -> Vec<u32> {
    let count = labelling.slots.len();
    let nodes = labelling.labels.len();
    let mut depth = vec![band + 1; nodes * count];
    for (v, l) in labelling.labels.iter().enumerate() {
        depth[v * count + usize::from(*l)] = 0;
    }
    for ring in 1..=band {
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
