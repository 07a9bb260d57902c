//! Rest-pose residual: each joint angle is pulled to 0 by its own weight.

use super::{Residual, RowTerm};

/// Pull of all joint angles towards the rest pose.
#[derive(Clone, Copy)]
pub struct RestPoseResidual<'a> {
    /// Joint angles, radians, shape `[angles]`.
    pub angles: &'a [f64],
    /// Weight of each angle, shape `[angles]`.
    pub weights: &'a [f64],
}

impl Residual for RestPoseResidual<'_> {
    type Term<'t> = RowTerm<'t>;

    fn for_each(&self, mut visit: impl FnMut(&RowTerm<'_>)) {
        for (k, (&angle, &weight)) in self.angles.iter().zip(self.weights).enumerate() {
            visit(&RowTerm {
                angles: &[k],
                slopes: &[1.0],
                residual: -angle,
                weight,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::ROOT_UNKNOWNS;
    use crate::registration::residual::check::Chain;

    #[test]
    fn derivatives_match_finite_differences() {
        Chain::check_rows(|_, x, weight, visit| {
            let angles: Vec<f64> = x[ROOT_UNKNOWNS..].iter().map(|x| x + 0.3).collect();
            let prior = RestPoseResidual {
                angles: &angles,
                weights: &[1.0, 2.0, 0.0, 0.5].map(|w| w * weight),
            };
            prior.for_each(visit);
        });
    }
}
