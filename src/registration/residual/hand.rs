//! Hand residual: the hand of an arm without readings of its own is pulled to a hand detected on its own.

use super::{Residual, RowTerm};
use crate::math::P3d;
use crate::registration::{Dof, ROOT_UNKNOWNS};
use nalgebra::Vector3;

/// One arm and the position of its detected hand, camera frame, metres.
#[derive(Clone, Copy)]
pub struct HandResidual<'a> {
    /// Joint angles of the arm.
    pub angles: &'a [usize],
    /// All degrees of freedom, as twists about `centre`.
    pub dofs: &'a [Dof],
    /// Origin of the twists.
    pub centre: &'a Vector3<f64>,
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
        let at = self.hand.coords - self.centre;
        for k in 0..3 {
            let slope = |&a: &usize| self.dofs[ROOT_UNKNOWNS + a].twist.velocity_at(&at)[k];
            let slopes: Vec<f64> = self.angles.iter().map(slope).collect();
            visit(&RowTerm {
                angles: self.angles,
                slopes: &slopes,
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
                angles: &chain.angles,
                dofs: &chain.dofs,
                centre: &chain.centre,
                hand: chain.moved(x)[3],
                target: P3d::new(0.3, 0.6, 1.9),
                weight,
            };
            hand.for_each(visit);
        });
    }
}
