//! Clearance residual: a point of an arm inside the trunk is pushed out of it, the shortest way along the section.

use super::{LimbMotion, Residual, RowTerm};
use nalgebra::Vector3;
use tryon_geometry::math::P3d;

/// Share of the way from axis to surface within which the direction out isn't known.
const AXIS: f64 = 1e-3;

/// An upright column of elliptic section, camera frame, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipticColumn {
    /// Centre of the lower end.
    pub base: P3d,
    /// Unit vectors across, up and to the front.
    pub axes: [Vector3<f64>; 3],
    /// Half axes of the section, across and to the front.
    pub half: [f64; 2],
    /// Height.
    pub height: f64,
}

impl EllipticColumn {
    /// Distance of `p` from the axis as a share of that of the surface, and its gradient, 1/m; `None` outside and on the axis.
    pub fn inside(&self, p: &P3d) -> Option<(f64, Vector3<f64>)> {
        let [across, up, front] = self.axes.map(|a| a.dot(&(p - self.base)));
        let scaled = [across / self.half[0], front / self.half[1]];
        let share = scaled[0].hypot(scaled[1]);
        let is_inside = (0.0..self.height).contains(&up) && (AXIS..1.0).contains(&share);
        let slope = |k: usize, axis: usize| self.axes[axis] * (scaled[k] / self.half[k]);
        is_inside.then(|| (share, (slope(0, 0) + slope(1, 2)) / share))
    }
}

/// One point of an arm and the trunk, which stays.
#[derive(Clone, Copy)]
pub struct ClearanceResidual<'a> {
    /// The arm.
    pub arm: LimbMotion<'a>,
    /// Point of the arm.
    pub point: P3d,
    /// The trunk.
    pub column: &'a EllipticColumn,
    /// Weight.
    pub weight: f64,
}

impl Residual for ClearanceResidual<'_> {
    type Term<'t> = RowTerm<'t>;

    fn for_each(&self, mut visit: impl FnMut(&RowTerm<'_>)) {
        let Some((share, gradient)) = self.column.inside(&self.point) else {
            return;
        };
        let depth = self.column.half[1];
        visit(&RowTerm {
            angles: self.arm.angles,
            slopes: &self.arm.slopes(&self.point, &(gradient * depth)),
            residual: depth * (1.0 - share),
            weight: self.weight,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::residual::check::Chain;

    fn column() -> EllipticColumn {
        EllipticColumn {
            base: P3d::new(0.15, 0.3, 1.75),
            axes: [Vector3::x(), Vector3::y(), Vector3::z()],
            half: [0.2, 0.15],
            height: 0.5,
        }
    }

    #[test]
    fn derivatives_match_finite_differences() {
        let column = column();
        Chain::check_rows(|chain, x, weight, visit| {
            let clearance = ClearanceResidual {
                arm: chain.limb(),
                point: chain.moved(x)[3],
                column: &column,
                weight,
            };
            clearance.for_each(visit);
        });
    }

    #[test]
    fn only_points_between_axis_and_surface_are_inside() {
        let c = column();
        let at = |across: f64, up: f64, front: f64| c.base + Vector3::new(across, up, front);
        let (share, gradient) = c.inside(&at(0.0, 0.2, 0.075)).expect("halfway");
        assert!((share - 0.5).abs() < 1e-12);
        assert!((gradient - Vector3::z() / 0.15).norm() < 1e-12);
        for p in [
            at(0.0, 0.2, 0.0),
            at(0.0, -0.1, 0.05),
            at(0.21, 0.2, 0.0),
            at(0.0, 0.6, 0.05),
        ] {
            assert_eq!(c.inside(&p), None, "{p}");
        }
    }
}
