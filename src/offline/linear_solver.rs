//! Search direction of a Newton iteration: factorisation or preconditioned conjugate gradients.

use super::error::OfflineError;
use crate::linear::{BlockMatrix, Factor, StopCriterion, SymbolicFactor, conjugate_gradient};
use crate::math::V3d;
use crate::par::Par;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Solver of the Newton system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum LinearMethod {
    /// Conjugate gradients with the inverse diagonal blocks as preconditioner.
    #[default]
    ConjugateGradient,
    /// Sparse Cholesky factorisation.
    Cholesky,
}

/// Replaces `direction` with the solution of `(Σ matrices) direction = right`; returns products with the matrix.
pub(super) fn solve(
    method: LinearMethod,
    (par, stop): (Par, StopCriterion),
    matrices: &[&BlockMatrix],
    right: &[V3d],
    direction: &mut [V3d],
) -> Result<usize, OfflineError> {
    match method {
        LinearMethod::ConjugateGradient => Ok(iterate((par, stop), matrices, right, direction)),
        LinearMethod::Cholesky => factorise(matrices, right, direction).map(|()| 0),
    }
}

fn iterate(
    (par, stop): (Par, StopCriterion),
    matrices: &[&BlockMatrix],
    right: &[V3d],
    direction: &mut [V3d],
) -> usize {
    let inverse: Vec<Matrix3<f64>> = (0..right.len())
        .map(|i| {
            let block = matrices
                .iter()
                .fold(Matrix3::zeros(), |sum, m| sum + m.diagonal(i));
            block.try_inverse().unwrap_or_else(Matrix3::identity)
        })
        .collect();
    let apply = |x: &[V3d], y: &mut [V3d]| {
        y.fill(V3d::zeros());
        for m in matrices {
            m.multiply_add(par, x, y);
        }
    };
    conjugate_gradient(apply, &inverse, right, direction, stop).iterations
}

fn factorise(
    matrices: &[&BlockMatrix],
    right: &[V3d],
    direction: &mut [V3d],
) -> Result<(), OfflineError> {
    let sum = BlockMatrix::sum(matrices)?;
    let (pattern, values) = sum.to_scalar()?;
    let mut factor = Factor::new(SymbolicFactor::new(Arc::new(pattern))?);
    factor.refactor(&values)?;
    let mut flat: Vec<f64> = right.iter().flat_map(|g| [g.x, g.y, g.z]).collect();
    factor.solve_vector(&mut flat);
    for (d, s) in direction.iter_mut().zip(flat.chunks_exact(3)) {
        *d = V3d::new(s[0], s[1], s[2]);
    }
    Ok(())
}
