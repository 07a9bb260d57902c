//! Energy of one element with its derivatives: the common currency of elasticity, contact and friction.

use nalgebra::{SMatrix, SVector};

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
