//! Normal equations of matched scan points in pose and shape, from the few unknowns that move each point.

use crate::dense_equations::DenseEquations;
use nalgebra::Vector3;
use tryon_body::Template;
use tryon_geometry::math::V3;
use tryon_geometry::mesh::Face;
use tryon_geometry::par::{self, Par};
use tryon_tracking::registration::Dof;

/// Matches in one partial sum.
const CHUNK: usize = 256;

/// A scan point on the surface.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Match {
    pub(super) face: u32,
    pub(super) corners: [f32; 3],
    pub(super) point: Vector3<f64>,
    pub(super) normal: Vector3<f64>,
    pub(super) residual: Vector3<f64>,
    pub(super) weight: f64,
}

/// Jacobian of the matches. Pose blend shapes are in the residuals and left out here: muscles and folds of skin move by a
/// centimetre while a joint turns by a radian, limbs by 25 cm.
pub(super) struct JacobianRows<'a> {
    pub(super) template: &'a Template,
    /// Weight of tangential beside normal distances.
    pub(super) tangential: f64,
    pub(super) dofs: &'a [Dof],
    /// Displacement of each vertex per unit of each unknown of the shape.
    pub(super) fields: &'a [Vec<V3>],
    /// Point that the twists are about, metres.
    pub(super) centre: Vector3<f64>,
}

/// Rows of one match along its normal and two tangents, scaled by the roots of their weights: the columns that are not zero.
#[derive(Debug, Default)]
struct MatchRows {
    /// Unknown of each column, ascending.
    unknowns: Vec<usize>,
    columns: Vec<[f64; 3]>,
    residuals: [f64; 3],
    /// Share of the point that moves with each bone or one below it.
    influence: Vec<f64>,
}

impl MatchRows {
    fn push(&mut self, unknown: usize, column: [f64; 3]) {
        self.unknowns.push(unknown);
        self.columns.push(column);
    }

    /// Adds Jᵀ J, upper triangle, and Jᵀ r.
    fn add_to(&self, sum: &mut DenseEquations) {
        let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        for (k, (&i, a)) in self.unknowns.iter().zip(&self.columns).enumerate() {
            sum.g[i] += dot(a, &self.residuals);
            let mut column = sum.h.column_mut(i);
            for (&j, b) in self.unknowns[..=k].iter().zip(&self.columns) {
                column[j] += dot(a, b);
            }
        }
    }
}

impl JacobianRows<'_> {
    /// Jᵀ W J and Jᵀ W r over all matches in `n` unknowns, summed in a fixed order.
    pub(super) fn normal_equations(&self, matches: &[Match], n: usize) -> DenseEquations {
        let good: Vec<&Match> = matches.iter().filter(|m| m.weight > 0.0).collect();
        let mut sums = Vec::new();
        let chunks = good.len().div_ceil(CHUNK);
        par::map_into(Par::Rayon, chunks, 1, &mut sums, |c| {
            let some = &good[c * CHUNK..((c + 1) * CHUNK).min(good.len())];
            let mut sum = DenseEquations::zeros(n);
            let mut rows = MatchRows::default();
            for m in some {
                self.fill(m, &mut rows);
                rows.add_to(&mut sum);
            }
            Some(sum)
        });
        let mut total = DenseEquations::zeros(n);
        sums.iter().flatten().for_each(|sum| total += sum);
        total.h.fill_lower_triangle_with_upper_triangle();
        total
    }

    fn fill(&self, m: &Match, rows: &mut MatchRows) {
        let face = self.template.mesh().faces()[m.face as usize];
        self.influence(&face, m.corners, &mut rows.influence);
        let across = if m.normal.x.abs() < 0.8 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let t = m.normal.cross(&across).normalize();
        let along = (m.weight * (1.0 + self.tangential)).sqrt();
        let tangential = (m.weight * self.tangential).sqrt();
        let axes = [
            m.normal * along,
            t * tangential,
            m.normal.cross(&t) * tangential,
        ];
        let lever = m.point - self.centre;
        let moments = axes.map(|axis| lever.cross(&axis));
        rows.unknowns.clear();
        rows.columns.clear();
        rows.residuals = axes.map(|axis| axis.dot(&m.residual));
        for (c, dof) in self.dofs.iter().enumerate() {
            let share = rows.influence[dof.bone];
            if share > 0.0 {
                let motion =
                    |k: usize| axes[k].dot(&dof.twist.linear) + moments[k].dot(&dof.twist.angular);
                rows.push(c, std::array::from_fn(|k| share * motion(k)));
            }
        }
        for (c, field) in self.fields.iter().enumerate() {
            let moved: V3 = (0..3).map(|i| field[face[i] as usize] * m.corners[i]).sum();
            let column = axes.map(|axis| axis.dot(&moved.cast()));
            rows.push(self.dofs.len() + c, column);
        }
    }

    /// Share of a surface point that moves with each bone or one below it.
    fn influence(&self, face: &Face, corners: [f32; 3], share: &mut Vec<f64>) {
        let weights = self.template.weights();
        let joints = self.template.skeleton().joints();
        share.clear();
        share.resize(joints.len(), 0.0);
        for (v, c) in face.iter().zip(corners) {
            let v = *v as usize;
            for k in 0..4 {
                share[usize::from(weights.joints[v][k])] += f64::from(weights.weights[v][k] * c);
            }
        }
        for j in (0..joints.len()).rev() {
            if let Some(p) = joints[j].parent {
                share[p] += share[j];
            }
        }
    }
}
