//! Colours of the scan gathered at the nodes of the template (B of eq. 12).

use super::color_mixture::{ColorMixture, hsv_cone};
use crate::body::Template;
use crate::clothcap::align::Alignment;
use crate::clothcap::scan::BodyScan;
use crate::mesh::{Csr, vertex_normals};
use crate::par::Par;
use nalgebra::Vector3;

/// Distance up to which a scan point belongs to the surface below it, metres.
const NEAR: f32 = 0.03;
/// Points of a node that count as independent: neighbours in a scan share their light and their weave.
const INDEPENDENT: f64 = 2.0;

/// BodyScan points and their colours at each node of the template.
#[derive(Clone, Debug)]
pub struct NodeColors {
    /// Points of each node.
    pub points: Csr,
    /// Colours of all points, [`hsv_cone`].
    pub colors: Vec<Vector3<f64>>,
    /// Mean colour of each node; `None` without points.
    pub means: Vec<Option<Vector3<f64>>>,
    /// Height of the aligned surface over the body model at each node, metres.
    pub heights: Vec<f32>,
}

impl NodeColors {
    /// Gathers the points of a scan at the nearest corners of their faces.
    pub fn new(scan: &BodyScan, alignment: &Alignment, template: &Template) -> Self {
        let (matches, faces) = (&alignment.matches, template.mesh().faces());
        let nodes = alignment.surface.len();
        let mut pairs = Vec::new();
        for (i, m) in matches.iter().enumerate() {
            if m.weight > 0.0 && m.distance < NEAR {
                pairs.push((faces[m.face as usize][m.nearest_corner()], i as u32));
            }
        }
        let points = Csr::from_pairs(nodes, &pairs);
        let colors: Vec<_> = scan.colors.iter().map(|c| hsv_cone(*c)).collect();
        let mean = |v: usize| {
            let row = points.row(v);
            let sum: Vector3<f64> = row.iter().map(|p| colors[*p as usize]).sum();
            (!row.is_empty() && !colors.is_empty()).then(|| sum / row.len() as f64)
        };
        let means = if colors.is_empty() {
            vec![None; nodes]
        } else {
            (0..nodes).map(mean).collect()
        };
        Self {
            heights: heights(alignment, template),
            points,
            colors,
            means,
        }
    }

    /// Colours of the points of some nodes.
    pub fn of(&self, nodes: impl Iterator<Item = usize>) -> Vec<Vector3<f64>> {
        let points = nodes.flat_map(|v| self.points.row(v));
        points
            .filter_map(|p| self.colors.get(*p as usize).copied())
            .collect()
    }

    /// Cost of an appearance at a node, nats; 0 without points, for all appearances alike.
    pub fn cost(&self, node: usize, appearance: &ColorMixture) -> f64 {
        let row = self.points.row(node);
        if row.is_empty() || self.colors.is_empty() {
            return 0.0;
        }
        let sum: f64 = row
            .iter()
            .map(|p| appearance.cost(&self.colors[*p as usize]))
            .sum();
        sum / row.len() as f64 * (row.len() as f64).min(INDEPENDENT)
    }
}

/// Height of the free surface over the surface that it is coupled to, along its normals, metres.
fn heights(alignment: &Alignment, template: &Template) -> Vec<f32> {
    let (faces, around) = (template.mesh().faces(), template.topology().vertex_faces());
    let mut normals = Vec::new();
    vertex_normals(Par::Rayon, &alignment.model, faces, around, &mut normals);
    let moved = alignment
        .surface
        .iter()
        .zip(&alignment.model)
        .map(|(a, b)| a - b);
    moved.zip(&normals).map(|(d, n)| d.dot(n)).collect()
}
