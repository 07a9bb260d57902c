//! Surface residual (eq. 12): distance of paired model points from their readings, point-to-plane and point-to-point.

use super::{PointTerm, Residual};
use crate::registration::{GemanMcClure, Metric, ModelPoints, Pair};
use tryon_geometry::spatial::OrganisedCloud;

/// Metric and robust kernel of paired points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceMetric {
    /// Weight of point-to-point.
    pub point_to_point: f64,
    /// Weight of point-to-plane, along the mean of the model's and the reading's normal (symmetric metric of Rusinkiewicz
    /// 2019).
    pub point_to_plane: f64,
    /// Weight pairs by the Geman–McClure kernel instead of 1.
    pub robust: bool,
    /// Width of the kernel, metres.
    pub sigma: f64,
    /// Length beyond which a pair is a pull, and its least kernel width, metres.
    pub pull_length: f64,
}

/// Paired model points and readings.
#[derive(Clone, Copy)]
pub struct SurfaceResidual<'a> {
    /// Posed model.
    pub model: &'a ModelPoints<'a>,
    /// Readings.
    pub grid: &'a OrganisedCloud,
    /// Correspondences.
    pub pairs: &'a [Pair],
    /// Use pairs found from the readings' side too.
    pub both_ways: bool,
    /// Metric and kernel.
    pub metric: SurfaceMetric,
}

impl Residual for SurfaceResidual<'_> {
    type Term<'t> = PointTerm;

    #[inline]
    fn for_each(&self, mut visit: impl FnMut(&PointTerm)) {
        let pairs = self.pairs.iter();
        for pair in pairs.filter(|p| self.both_ways || !p.from_data) {
            let i = pair.model as usize;
            let p = self.model.positions[i].coords.cast::<f64>();
            let r = self.grid.points[pair.cell as usize].coords.cast::<f64>() - p;
            let normal = self.model.normals[i].cast::<f64>();
            let both = normal + self.grid.normals[pair.cell as usize].cast::<f64>();
            let direction = both.try_normalize(f64::EPSILON).unwrap_or(normal);
            let sigma = self.metric.sigma;
            let kernel = GemanMcClure {
                sigma: if r.norm() > self.metric.pull_length {
                    sigma.max(self.metric.pull_length)
                } else {
                    sigma
                },
            };
            let e2 = r.norm_squared();
            visit(&PointTerm {
                sample: i,
                bone: usize::from(self.model.bones[i]),
                point: p,
                residual: r,
                metric: Metric {
                    isotropic: self.metric.point_to_point,
                    directional: self.metric.point_to_plane,
                    direction,
                },
                weight: if self.metric.robust {
                    kernel.weight(e2)
                } else {
                    1.0
                },
                cost: kernel.value(e2),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::registration::residual::check::Scan;

    #[test]
    fn derivatives_match_finite_differences() {
        for robust in [false, true] {
            Scan::check_points(|scan, model, weight, visit| {
                scan.surface(model, robust, weight, visit);
            });
        }
    }
}
