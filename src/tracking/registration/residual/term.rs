//! Least-squares terms ½ w rᵀ M r and the interface of the residuals that consist of them.

use crate::registration::Metric;
use nalgebra::Vector3;

/// A residual as a list of terms at the current pose. Weights and metrics are constants of the linearisation, as in
/// iteratively reweighted least squares.
pub trait Residual {
    /// [`PointTerm`] or [`RowTerm`].
    type Term<'t>;

    /// Visits all terms in a fixed order, so that sums keep their bits.
    fn for_each(&self, visit: impl FnMut(&Self::Term<'_>));
}

/// Term of one sample point; its Jacobian by the twist of the point's bone is `−[I | −[p]ₓ]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointTerm {
    /// Model point.
    pub sample: usize,
    /// Bone of the point.
    pub bone: usize,
    /// Position p, camera frame, metres.
    pub point: Vector3<f64>,
    /// Target minus position r, metres.
    pub residual: Vector3<f64>,
    /// Quadratic form M.
    pub metric: Metric,
    /// Weight w.
    pub weight: f64,
    /// Robust cost ρ(|r|²) by which poses of one frame compare, m²; 0 for terms outside that comparison.
    pub cost: f64,
}

/// Scalar term ½ w (r − slopes · x)² over some joint angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowTerm<'a> {
    /// Joint angles it depends on.
    pub angles: &'a [usize],
    /// Derivative of the measured quantity by each of them.
    pub slopes: &'a [f64],
    /// Target minus measured quantity r, metres or radians.
    pub residual: f64,
    /// Weight w.
    pub weight: f64,
}
