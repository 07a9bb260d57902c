//! Edge residual (eq. 10 in metres): distance of an outline point from the viewing ray of its pair.

use super::{PointTerm, Residual};
use crate::registration::{GemanMcClure, Metric, ModelPoints};
use tryon_geometry::spatial::OrganisedCloud;

/// Model points paired with cells of the subject's outline.
#[derive(Clone, Copy)]
pub struct EdgeResidual<'a> {
    /// Posed model.
    pub model: &'a ModelPoints<'a>,
    /// Readings.
    pub grid: &'a OrganisedCloud,
    /// Model point and outline cell.
    pub pairs: &'a [(u32, u32)],
    /// Weight of a pair at distance 0 (λₑ of eq. 12).
    pub weight: f64,
    /// Width of the robust kernel, metres.
    pub sigma: f64,
}

impl Residual for EdgeResidual<'_> {
    type Term<'t> = PointTerm;

    #[inline]
    fn for_each(&self, mut visit: impl FnMut(&PointTerm)) {
        let kernel = GemanMcClure { sigma: self.sigma };
        for &(i, cell) in self.pairs {
            let i = i as usize;
            let p = self.model.positions[i].coords.cast::<f64>();
            let reading = self.grid.points[cell as usize].coords;
            let ray = reading.cast::<f64>().normalize();
            let r = ray * ray.dot(&p) - p;
            visit(&PointTerm {
                sample: i,
                bone: usize::from(self.model.bones[i]),
                point: p,
                residual: r,
                metric: Metric {
                    isotropic: 1.0,
                    directional: -1.0,
                    direction: ray,
                },
                weight: self.weight * kernel.weight(r.norm_squared()),
                cost: 0.0,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::registration::residual::check::Scan;

    #[test]
    fn derivatives_match_finite_differences() {
        Scan::check_points(Scan::edge);
    }
}
