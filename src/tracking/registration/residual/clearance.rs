//! Clearance residual: a point of an arm inside the trunk is pushed out of it, the shortest way along the section.

use super::{LimbMotion, Residual, RowTerm};
use tryon_body::parts::EllipticColumn;
use tryon_geometry::math::P3d;

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
    use nalgebra::Vector3;

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
}
