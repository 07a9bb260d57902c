//! Second-order expansion of the elastic energy of a whole sheet, on a fixed sparsity.

use super::fan_expansion::CurvatureBuffers;
use super::packed::Packed;
use nalgebra::Matrix3;
use tryon_geometry::math::V3d;

/// Value, gradient and Hessian of a sheet's elastic energy. Its buffers are reused from call to call.
#[derive(Clone, Debug, Default)]
pub struct ElasticExpansion {
    /// Energy (J).
    pub value: f64,
    /// Derivative by the positions (N), shape `[vertices]`; the elastic force is its negative.
    pub gradient: Vec<V3d>,
    /// Diagonal blocks of the Hessian (N/m), shape `[vertices]`.
    pub diagonal: Vec<Matrix3<f64>>,
    /// Blocks (i, j) of the Hessian for the model's pairs i < j (N/m), shape `[pairs]`; (j, i) is the transpose.
    pub off_diagonal: Vec<Matrix3<f64>>,
    pub(super) buffers: ElementBuffers,
}

/// Expansions of the single elements.
#[derive(Clone, Debug, Default)]
pub(super) struct ElementBuffers {
    pub(super) membranes: Vec<Packed>,
    pub(super) curvatures: CurvatureBuffers,
}

impl ElasticExpansion {
    /// Sets all sums to zero.
    pub(super) fn reset(&mut self, vertices: usize, pairs: usize) {
        self.value = 0.0;
        for (sums, n) in [
            (&mut self.diagonal, vertices),
            (&mut self.off_diagonal, pairs),
        ] {
            sums.clear();
            sums.resize(n, Matrix3::zeros());
        }
        self.gradient.clear();
        self.gradient.resize(vertices, V3d::zeros());
    }
}
