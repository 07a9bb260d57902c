//! Colours of the scan gathered at the nodes of the template (B of eq. 12).

use super::color_mixture::{ColorMixture, hsv_cone};
#[cfg(test)]
use super::prior::BodyRegion;
use crate::align::Alignment;
use crate::scan::BodyScan;
use crate::settings::{LabelSettings, MixtureSettings};
use nalgebra::Vector3;
use tryon_body::Template;
#[cfg(test)]
use tryon_geometry::math::P3;
use tryon_geometry::math::V3;
use tryon_geometry::mesh::Csr;

/// Scan points and their colours at each node of the template.
#[derive(Clone, Debug)]
pub struct NodeColors {
    /// Points of each node.
    pub points: Csr,
    /// Colours of all points, [`hsv_cone`].
    pub colors: Vec<Vector3<f64>>,
    /// Mean colour of each node; `None` without points.
    pub means: Vec<Option<Vector3<f64>>>,
    /// Height of the scan over the body model at each node, metres.
    pub heights: Vec<f32>,
    /// The same above the mean of its neighbours, metres: opposite signs
    /// on both sides of a hem, none where cloth flares.
    pub steps: Vec<f32>,
    /// Settings of the segmentation.
    pub settings: LabelSettings,
}

impl NodeColors {
    /// Gathers the points of a scan at the nearest corners of their faces.
    pub fn new(
        scan: &BodyScan,
        alignment: &Alignment,
        template: &Template,
        settings: &LabelSettings,
    ) -> Self {
        let (matches, faces) = (&alignment.matches, template.mesh().faces());
        let nodes = alignment.surface.len();
        let mut pairs = Vec::new();
        for (i, m) in matches.iter().enumerate() {
            if m.weight > 0.0 && m.distance < settings.near {
                pairs.push((m.nearest_vertex(faces), i as u32));
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
        let heights = heights(alignment, template, scan, &points);
        Self {
            steps: steps(&heights, template.topology().vertex_neighbours()),
            heights,
            points,
            colors,
            means,
            settings: *settings,
        }
    }

    /// Appearance of the points of some nodes; `None` without any.
    pub fn appearance(&self, nodes: impl Iterator<Item = usize>) -> Option<ColorMixture> {
        self.fitted(nodes, &self.settings.colors)
    }

    /// The same with the modes of skin.
    pub fn skin_appearance(&self, nodes: impl Iterator<Item = usize>) -> Option<ColorMixture> {
        let settings = self.settings.colors;
        let modes = settings.skin_modes;
        self.fitted(nodes, &MixtureSettings { modes, ..settings })
    }

    fn fitted(
        &self,
        nodes: impl Iterator<Item = usize>,
        settings: &MixtureSettings,
    ) -> Option<ColorMixture> {
        let points = nodes.flat_map(|v| self.points.row(v));
        let colors = points.filter_map(|p| self.colors.get(*p as usize).copied());
        ColorMixture::fit(&colors.collect::<Vec<_>>(), settings)
    }

    /// Cost of an appearance at a node, nats; 0 without points, for all appearances alike.
    pub fn cost(&self, node: usize, appearance: &ColorMixture) -> f64 {
        let row = self.points.row(node);
        if row.is_empty() || self.colors.is_empty() {
            return 0.0;
        }
        let outliers = self.settings.colors.outliers;
        let cost = |p: &u32| appearance.cost(&self.colors[*p as usize], outliers);
        let sum: f64 = row.iter().map(cost).sum();
        sum / row.len() as f64 * (row.len() as f64).min(self.settings.independent)
    }
}

#[cfg(test)]
impl NodeColors {
    /// One point a node, painted by place and region, in light from above and in front, at heights over the body (m).
    pub(super) fn painted(
        template: &Template,
        color: impl Fn(&P3, BodyRegion) -> [f32; 3],
        height: impl Fn(&P3) -> f32,
    ) -> Self {
        let (mesh, regions) = (template.mesh(), BodyRegion::of_vertices(template));
        let normals = template.normals(mesh.vertices());
        let painted = |(v, p): (usize, &P3)| {
            let n = normals[v];
            let light = 0.6 + 0.25 * n.y.max(0.0) + 0.15 * n.z.max(0.0);
            let grain = 1.0 + 0.02 * ((v * 7919) % 13) as f32 / 13.0;
            hsv_cone(color(p, regions[v]).map(|c| (c * light * grain) as u8))
        };
        let colors: Vec<_> = mesh.vertices().iter().enumerate().map(painted).collect();
        let pairs: Vec<_> = (0..regions.len() as u32).map(|v| (v, v)).collect();
        let heights: Vec<f32> = mesh.vertices().iter().map(height).collect();
        Self {
            points: Csr::from_pairs(regions.len(), &pairs),
            means: colors.iter().copied().map(Some).collect(),
            colors,
            steps: steps(&heights, template.topology().vertex_neighbours()),
            heights,
            settings: LabelSettings::default(),
        }
    }
}

/// Heights above the mean of their neighbours, metres.
fn steps(heights: &[f32], around: &Csr) -> Vec<f32> {
    let step = |(v, h): (usize, &f32)| {
        let near = around.row(v).iter().map(|w| heights[*w as usize]);
        h - mean(near).unwrap_or(*h)
    };
    heights.iter().enumerate().map(step).collect()
}

fn mean(values: impl Iterator<Item = f32>) -> Option<f32> {
    let (sum, n) = values.fold((0.0, 0), |(s, n), v| (s + v, n + 1));
    (n > 0).then(|| sum / n as f32)
}

/// Height of the scan over the surface that the free one is coupled to, along its normals, metres: of the free surface,
/// with the mean of what it leaves of the node's points.
fn heights(alignment: &Alignment, template: &Template, scan: &BodyScan, points: &Csr) -> Vec<f32> {
    let faces = template.mesh().faces();
    let normals = template.normals(&alignment.model);
    let height = |v: usize| {
        let left = points.row(v).iter().map(|p| {
            let m = &alignment.matches[*p as usize];
            let corners = faces[m.face as usize].map(|c| alignment.surface[c as usize].coords);
            let on: V3 = (0..3).map(|k| corners[k] * m.corners[k]).sum();
            (scan.points[*p as usize].coords - on).dot(&normals[v])
        });
        let fitted = (alignment.surface[v] - alignment.model[v]).dot(&normals[v]);
        fitted + mean(left).unwrap_or(0.0)
    };
    (0..alignment.surface.len()).map(height).collect()
}
