//! Points bound to the skin of a body: the vertices below them and the joints they follow.

use super::SkinSearch;
use crate::Template;
use std::collections::BTreeMap;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::smoothing::half_mean;

/// Rounds of averaging over the garment: the nearest vertex jumps between neighbours, cloth does not.
const ROUNDS: usize = 6;
/// Cloth farther than this from the skin (a skirt between the legs) is averaged over more of it, metres.
const LOOSE: f32 = 0.04;
/// Further rounds for loose cloth.
const LOOSE_ROUNDS: usize = 30;
/// Most skin vertices below one point; more cost time without effect.
const MOST_VERTICES: usize = 16;
/// Distance within which skin is searched, metres: all of a body.
const ANYWHERE: f32 = 100.0;

/// Vertices with weights that sum to one.
pub type VertexWeights = Vec<(u32, f32)>;

/// Points bound to a skin. All fields have shape `[points]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkinBinding {
    /// Skin vertices below each point, heaviest first.
    pub vertices: Vec<VertexWeights>,
    /// Weights of all joints.
    pub joints: Vec<Vec<f32>>,
    /// Distance from the nearest skin vertex, metres.
    pub distance: Vec<f32>,
    /// Outward normal of the nearest skin vertex.
    pub normal: Vec<V3>,
}

impl SkinBinding {
    /// Binds points (frame of the body, metres) to a body; `neighbours` along the edges of their mesh.
    pub fn new(template: &Template, points: &[P3], neighbours: impl Fn(usize) -> Vec<u32>) -> Self {
        let mut out = Self::nearest(template, points);
        let around: Vec<Vec<u32>> = (0..points.len()).map(neighbours).collect();
        for round in 0..ROUNDS + LOOSE_ROUNDS {
            let active = |i: usize| round < ROUNDS || out.distance[i] > LOOSE;
            let next: Vec<_> = (0..points.len())
                .map(|i| (active(i) && !around[i].is_empty()).then(|| out.averaged(i, &around[i])))
                .collect();
            for (i, n) in next.into_iter().enumerate() {
                if let Some(n) = n {
                    (out.joints[i], out.vertices[i]) = n;
                }
            }
        }
        out
    }
    /// Binds each point to its nearest skin vertex.
    fn nearest(template: &Template, points: &[P3]) -> Self {
        let skin = SkinSearch::new(template, template.mesh().vertices(), 0.0);
        let mut out = Self::default();
        for p in points {
            let found = skin.nearest(p, &V3::zeros(), ANYWHERE);
            let (near, d2) = found.unwrap_or((0, 0.0));
            let joints = template.skeleton().len();
            out.vertices.push(vec![(near as u32, 1.0)]);
            out.joints.push(template.weights().row(near, joints));
            out.distance.push(d2.sqrt());
            out.normal.push(skin.normals[near]);
        }
        out
    }
    /// Half of a point's own weights and half of its neighbours' mean: of joints, and of the heaviest vertices.
    fn averaged(&self, i: usize, around: &[u32]) -> (Vec<f32>, VertexWeights) {
        let share = 0.5 / around.len() as f32;
        let neighbours = around.iter().map(|n| &self.joints[*n as usize]);
        let joints = half_mean(&self.joints[i], neighbours);
        let mut vertices: BTreeMap<u32, f32> = BTreeMap::new();
        for (v, w) in &self.vertices[i] {
            *vertices.entry(*v).or_default() += 0.5 * w;
        }
        for n in around.iter().map(|n| *n as usize) {
            for (v, w) in &self.vertices[n] {
                *vertices.entry(*v).or_default() += share * w;
            }
        }
        let mut vertices: VertexWeights = vertices.into_iter().collect();
        vertices.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        vertices.truncate(MOST_VERTICES);
        let sum: f32 = vertices.iter().map(|o| o.1).sum();
        for o in &mut vertices {
            o.1 /= sum.max(f32::MIN_POSITIVE);
        }
        (joints, vertices)
    }
}
