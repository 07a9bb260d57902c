//! Surface displacements along the rest normals (section 3.3, eq. 13 to 17), by warm-started conjugate gradients.

use crate::fit::{FitContext, FitScratch};
use crate::model::{PersonalBody, TrackerModel};
use crate::registration::IndexImage;
use crate::settings::SurfaceSettings;
use serde::{Deserialize, Serialize};
use tryon_body::{BoneTransforms, skin};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Csr;
use tryon_geometry::par::Par;
use tryon_geometry::spatial::Label;

/// Mean and variance of each displacement, updated online.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SurfaceStatistics {
    /// Updates so far.
    pub count: u32,
    mean: Vec<f32>,
    /// Sum of squared deviations.
    spread: Vec<f32>,
}

/// Scratch of the fit.
#[derive(Clone, Debug, Default)]
pub(crate) struct SurfaceScratch {
    before: Vec<f32>,
    posed: Vec<P3>,
    target: Vec<f32>,
    weight: Vec<f32>,
    diagonal: Vec<f32>,
    residual: Vec<f32>,
    direction: Vec<f32>,
    image: Vec<f32>,
    preconditioned: Vec<f32>,
    laplacian: Vec<V3>,
}

/// Diagonal of LᵀL of a regular mesh: 1 + 1/degree, for the preconditioner.
const LAPLACIAN_DIAGONAL: f32 = 1.17;

/// Updates displacements (metres, shape `[vertices]`) from one frame, at the pose that `paired` holds. Returns the number
/// of vertices with a reading and the root mean square of the change, metres.
pub(crate) fn fit_displacements(
    context: &FitContext<'_>,
    paired: &FitScratch,
    displacements: &mut Vec<f32>,
    statistics: &mut SurfaceStatistics,
    s: &mut SurfaceScratch,
) -> (usize, f32) {
    let n = context.body.rest.base.len();
    displacements.resize(n, 0.0);
    statistics.mean.resize(n, 0.0);
    statistics.spread.resize(n, 0.0);
    let readings = measure(context, &paired.bones, &paired.pairing.image, s);
    s.before.clone_from(displacements);
    solve(context.model, context.body, displacements, statistics, s);
    let change: f32 = displacements
        .iter()
        .zip(&s.before)
        .map(|(a, b)| (a - b) * (a - b))
        .sum();
    statistics.add(displacements);
    (readings, (change / n.max(1) as f32).sqrt())
}

impl SurfaceStatistics {
    /// Updates mean and spread (Welford).
    fn add(&mut self, displacements: &[f32]) {
        self.count += 1;
        let count = self.count as f32;
        for (i, d) in displacements.iter().enumerate() {
            let off = d - self.mean[i];
            self.mean[i] += off / count;
            self.spread[i] += off * (d - self.mean[i]);
        }
    }
}

/// Fills target (signed distance along the normal to the plane of its reading, metres) and weight of each vertex; returns
/// the number of vertices with a reading.
fn measure(
    context: &FitContext<'_>,
    bones: &BoneTransforms,
    image: &IndexImage,
    s: &mut SurfaceScratch,
) -> usize {
    let settings = &context.model.config.shape.surface;
    let (rest, observation) = (&context.body.rest, context.observation);
    let (weights, grid) = (context.model.template.weights(), observation.grid);
    let n = rest.base.len();
    skin(Par::Seq, &rest.base, weights, bones, &mut s.posed);
    let rotations: Vec<_> = bones
        .bones
        .iter()
        .map(|b| b.rotation.to_rotation_matrix().into_inner().cast::<f32>())
        .collect();
    s.target.clear();
    s.target.resize(n, 0.0);
    s.weight.clear();
    s.weight.resize(n, 0.0);
    let mut readings = 0;
    for i in 0..n {
        let p = s.posed[i];
        let normal = rotations[weights.dominant(i)] * rest.normals[i];
        if normal.dot(&p.coords) > -settings.grazing * p.coords.norm() {
            continue;
        }
        let Some(cell) = grid.cell_of(&p).and_then(|(u, v)| grid.cell(u, v)) else {
            continue;
        };
        let usable = grid.labels[cell] == Label::Person && !observation.false_edges[cell];
        if !usable || p.z > image.depth[cell] + settings.hidden {
            continue;
        }
        let facet = grid.normals[cell];
        let slope = facet.dot(&normal);
        if slope < settings.cos_normal {
            continue;
        }
        let d = facet.dot(&(grid.points[cell] - p)) / slope;
        if d.abs() < settings.distance {
            s.target[i] = d;
            s.weight[i] = 1.0;
            readings += 1;
        }
    }
    readings
}

/// Dot product, summed in f64 in a fixed order.
fn dot(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(x, y)| f64::from(x * y)).sum()
}

/// Conjugate gradients with a Jacobi preconditioner from the current displacements `d`.
fn solve(
    model: &TrackerModel,
    body: &PersonalBody,
    d: &mut [f32],
    statistics: &SurfaceStatistics,
    s: &mut SurfaceScratch,
) {
    let n = d.len();
    let settings = &model.config.shape.surface;
    let (template, rest) = (&model.template, &body.rest);
    let neighbours = template.topology().vertex_neighbours();
    let temporal = |i: usize| {
        if statistics.count < settings.temporal_from {
            return 0.0;
        }
        let variance = statistics.spread[i] / statistics.count as f32
            + settings.least_deviation * settings.least_deviation;
        settings.temporal * settings.unit_deviation * settings.unit_deviation / variance
    };
    s.diagonal.clear();
    for i in 0..n {
        s.diagonal.push(s.weight[i] + temporal(i) + settings.ridge);
    }
    // b = ω t + temporal μ; r = b − A d.
    let system = SurfaceSystem {
        neighbours,
        normals: &rest.normals,
        diagonal: &s.diagonal,
        settings,
    };
    system.multiply(d, &mut s.laplacian, &mut s.image);
    s.residual.clear();
    for i in 0..n {
        let b = s.weight[i] * s.target[i] + temporal(i) * statistics.mean[i];
        s.residual.push(b - s.image[i]);
    }
    let jacobi: Vec<f32> = (0..n)
        .map(|i| {
            1.0 / (s.diagonal[i]
                + settings.spatial * neighbours.row(i).len() as f32
                + settings.laplacian * LAPLACIAN_DIAGONAL)
        })
        .collect();
    s.preconditioned.clear();
    s.preconditioned
        .extend(s.residual.iter().zip(&jacobi).map(|(r, m)| r * m));
    s.direction.clone_from(&s.preconditioned);
    let mut rz = dot(&s.residual, &s.preconditioned);
    for _ in 0..settings.iterations {
        system.multiply(&s.direction, &mut s.laplacian, &mut s.image);
        let curvature = dot(&s.direction, &s.image);
        if curvature <= 0.0 || rz <= 0.0 {
            break;
        }
        let alpha = (rz / curvature) as f32;
        for i in 0..n {
            d[i] += alpha * s.direction[i];
            s.residual[i] -= alpha * s.image[i];
            s.preconditioned[i] = s.residual[i] * jacobi[i];
        }
        let next = dot(&s.residual, &s.preconditioned);
        let beta = (next / rz) as f32;
        rz = next;
        for i in 0..n {
            s.direction[i] = s.preconditioned[i] + beta * s.direction[i];
        }
    }
}

/// System matrix of eq. 17: diagonal + spatial weight · graph Laplacian + Laplacian weight · LᵀL.
///
/// (L x)ᵢ = nᵢ xᵢ − mean of the neighbours' nⱼ xⱼ (eq. 14 with the mean for the sum, so that flat parts cost nothing).
struct SurfaceSystem<'a> {
    neighbours: &'a Csr,
    normals: &'a [V3],
    diagonal: &'a [f32],
    settings: &'a SurfaceSettings,
}

impl SurfaceSystem<'_> {
    /// Writes the product with `x` into `out`; `laplacian` receives L x.
    fn multiply(&self, x: &[f32], laplacian: &mut Vec<V3>, out: &mut Vec<f32>) {
        let settings = self.settings;
        let (neighbours, normals, diagonal) = (self.neighbours, self.normals, self.diagonal);
        let n = x.len();
        laplacian.clear();
        out.clear();
        for i in 0..n {
            let row = neighbours.row(i);
            let (mut sum, mut difference) = (V3::zeros(), 0.0);
            for &j in row {
                let j = j as usize;
                sum += normals[j] * x[j];
                difference += x[i] - x[j];
            }
            let degree = row.len().max(1) as f32;
            laplacian.push(normals[i] * x[i] - sum / degree);
            out.push(diagonal[i] * x[i] + settings.spatial * difference);
        }
        for i in 0..n {
            let mut sum = laplacian[i];
            for &j in neighbours.row(i) {
                let j = j as usize;
                sum -= laplacian[j] / neighbours.row(j).len().max(1) as f32;
            }
            out[i] += settings.laplacian * normals[i].dot(&sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use tryon_body::embedded;

    #[test]
    fn the_system_is_symmetric_and_positive() {
        let template = embedded::template();
        let rest = template.personalise(&Default::default());
        let n = rest.normals.len();
        let mut rng = rand_pcg::Pcg32::seed_from_u64(5);
        let mut random = || -> Vec<f32> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let (x, y) = (random(), random());
        let settings = SurfaceSettings::default();
        let system = SurfaceSystem {
            neighbours: template.topology().vertex_neighbours(),
            normals: &rest.normals,
            diagonal: &vec![settings.ridge; n],
            settings: &settings,
        };
        let product = |x: &[f32]| {
            let mut out = Vec::new();
            system.multiply(x, &mut Vec::new(), &mut out);
            out
        };
        let (xay, yax, xax) = (
            dot(&x, &product(&y)),
            dot(&y, &product(&x)),
            dot(&x, &product(&x)),
        );
        assert!((xay - yax).abs() < 1e-5 * xax, "{xay} against {yax}");
        assert!(xax > f64::from(settings.ridge) * dot(&x, &x), "{xax}");
        assert!(product(&vec![0.0; n]).iter().all(|v| *v == 0.0));
    }
}
