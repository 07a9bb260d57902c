//! Free-space residual: a model point in front of a reading moves back along its viewing ray to that reading.

use super::{PointTerm, Residual};
use crate::registration::{Metric, ModelPoints};
use tryon_geometry::spatial::OrganisedCloud;

/// Longest residual of one iteration, metres; larger overshoots where the reading belongs to another limb.
const LONGEST: f64 = 0.10;

/// Model points in front of the subject's readings.
#[derive(Clone, Copy)]
pub struct FreeSpaceResidual<'a> {
    /// Posed model.
    pub model: &'a ModelPoints<'a>,
    /// Readings.
    pub grid: &'a OrganisedCloud,
    /// Model point and the cell it projects to.
    pub in_front: &'a [(u32, u32)],
    /// Weight of a point.
    pub weight: f64,
}

impl Residual for FreeSpaceResidual<'_> {
    type Term<'t> = PointTerm;

    #[inline]
    fn for_each(&self, mut visit: impl FnMut(&PointTerm)) {
        for &(i, cell) in self.in_front {
            let i = i as usize;
            let p = self.model.positions[i].coords.cast::<f64>();
            let ray = p.normalize();
            let behind = f64::from(self.grid.depth[cell as usize]) / ray.z - p.norm();
            visit(&PointTerm {
                sample: i,
                bone: usize::from(self.model.bones[i]),
                point: p,
                residual: ray * behind.clamp(0.0, LONGEST),
                metric: Metric {
                    isotropic: 0.0,
                    directional: 1.0,
                    direction: ray,
                },
                weight: self.weight,
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
        Scan::check_points(Scan::free_space);
    }
}
