//! Energy of one element with its derivatives: the common currency of elasticity, contact and friction.

use super::V3d;
use nalgebra::{Matrix3, SMatrix, SVector};

/// Second-order expansion of an element's energy about its present positions, `N` = 3 × vertices of the element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElementEnergy<const N: usize> {
    /// Energy (J).
    pub value: f64,
    /// Derivative by the stacked vertex positions (N), shape `[N]`, vertex-major.
    pub gradient: SVector<f64, N>,
    /// Second derivative (N/m), shape `[N, N]`, symmetric; positive semi-definite where the function says so.
    pub hessian: SMatrix<f64, N, N>,
}

impl<const N: usize> Default for ElementEnergy<N> {
    fn default() -> Self {
        Self {
            value: 0.0,
            gradient: SVector::zeros(),
            hessian: SMatrix::zeros(),
        }
    }
}

impl ElementEnergy<9> {
    /// Energy (J) of three vertices by the gradient of each (N) and the Hessian of each pair (N/m).
    pub fn of_corners(
        value: f64,
        gradient: impl Fn(usize) -> V3d,
        hessian: impl Fn(usize, usize) -> Matrix3<f64>,
    ) -> Self {
        let mut energy = Self {
            value,
            ..Self::default()
        };
        for i in 0..3 {
            (energy.gradient.fixed_rows_mut::<3>(3 * i)).copy_from(&gradient(i));
            for j in 0..3 {
                let mut block = energy.hessian.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                block.copy_from(&hessian(i, j));
            }
        }
        energy
    }
}
