//! Hand residual: the hand of an arm without readings of its own is pulled to a hand detected on its own.

use super::{LimbMotion, Residual, RowTerm};
use nalgebra::Vector3;
use tryon_geometry::math::P3d;

/// One arm and the position of its detected hand, camera frame, metres.
#[derive(Clone, Copy)]
pub struct HandResidual<'a> {
    /// The arm.
    pub arm: LimbMotion<'a>,
    /// Hand of the model.
    pub hand: P3d,
    /// Detected hand.
    pub target: P3d,
    /// Weight per coordinate.
    pub weight: f64,
}

impl Residual for HandResidual<'_> {
    type Term<'t> = RowTerm<'t>;

    fn for_each(&self, mut visit: impl FnMut(&RowTerm<'_>)) {
        for (k, axis) in [Vector3::x(), Vector3::y(), Vector3::z()]
            .iter()
            .enumerate()
        {
            visit(&RowTerm {
                angles: self.arm.angles,
                slopes: &self.arm.slopes(&self.hand, axis),
                residual: self.target[k] - self.hand[k],
                weight: self.weight,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::residual::check::Chain;

    #[test]
    fn derivatives_match_finite_differences() {
        Chain::check_rows(|chain, x, weight, visit| {
            let hand = HandResidual {
                arm: chain.limb(),
                hand: chain.moved(x)[3],
                target: P3d::new(0.3, 0.6, 1.9),
                weight,
            };
            hand.for_each(visit);
        });
    }
}
