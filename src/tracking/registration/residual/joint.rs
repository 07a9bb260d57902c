//! Joint residual: a joint is pulled to where an eye sees it, as far as that is surer than the eye's uncertainty.

use super::{PointTerm, Residual};
use crate::registration::{GemanMcClure, Metric};
use nalgebra::Vector3;
use tryon_geometry::math::P3d;

/// A place for the middle of two joints, or of one joint twice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointTarget {
    /// The joints.
    pub joints: [usize; 2],
    /// Bone that carries their middle.
    pub bone: usize,
    /// Place, camera frame, metres.
    pub position: P3d,
    /// Confidence, 0 to 1.
    pub weight: f64,
}

/// Joints of a posed body and their targets.
#[derive(Clone, Copy, Debug)]
pub struct JointResidual<'a> {
    /// Posed joints, camera frame, metres.
    pub joints: &'a [P3d],
    /// Places for some of them.
    pub targets: &'a [JointTarget],
    /// Distance up to which a joint is where it is seen, metres.
    pub uncertainty: f64,
    /// Width of the robust kernel, metres.
    pub sigma: f64,
    /// Weight of a sure target just beyond the uncertainty.
    pub weight: f64,
}

impl Residual for JointResidual<'_> {
    type Term<'t> = PointTerm;

    fn for_each(&self, mut visit: impl FnMut(&PointTerm)) {
        let kernel = GemanMcClure { sigma: self.sigma };
        for (k, target) in self.targets.iter().enumerate() {
            let [a, b] = target.joints.map(|j| self.joints[j]);
            let point = nalgebra::center(&a, &b);
            let off = target.position - point;
            let beyond = 1.0 - self.uncertainty / off.norm();
            if !(beyond > 0.0) {
                continue;
            }
            let residual = off * beyond;
            visit(&PointTerm {
                sample: k,
                bone: target.bone,
                point: point.coords,
                residual,
                metric: Metric {
                    isotropic: 1.0,
                    directional: 0.0,
                    direction: Vector3::z(),
                },
                weight: self.weight * target.weight * kernel.weight(residual.norm_squared()),
                cost: 0.0,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_are_pulled_from_beyond_the_uncertainty_alone() {
        let joints = [P3d::new(0.0, 0.0, 2.0), P3d::new(0.2, 0.0, 2.0)];
        let pull = |off: Vector3<f64>| {
            let target = JointTarget {
                joints: [0, 1],
                bone: 1,
                position: P3d::new(0.1, 0.0, 2.0) + off,
                weight: 0.5,
            };
            let residual = JointResidual {
                joints: &joints,
                targets: &[target],
                uncertainty: 0.05,
                sigma: 0.3,
                weight: 2.0,
            };
            let mut terms = Vec::new();
            residual.for_each(|t| terms.push(*t));
            terms
        };
        for near in [0.0, 0.049] {
            assert!(pull(Vector3::x() * near).is_empty(), "{near}");
        }
        let terms = pull(Vector3::y() * 0.25);
        assert_eq!(terms.len(), 1);
        assert!((terms[0].residual - Vector3::y() * 0.2).norm() < 1e-12);
        assert!((terms[0].point - Vector3::new(0.1, 0.0, 2.0)).norm() < 1e-12);
        let kernel = (0.09f64 / (0.09 + 0.04)).powi(2);
        assert!((terms[0].weight - kernel).abs() < 1e-12 && terms[0].bone == 1);
    }
}
