//! Preconditioners of conjugate gradients on blocks of three.

use super::{BlockMatrix, CoarseSpace};
use nalgebra::{Matrix3, Vector3};

/// Approximate inverse of a matrix, symmetric and positive.
pub trait Preconditioner {
    /// Replaces `z` with the approximate solution of `A z = r`.
    fn apply(&mut self, r: &[Vector3<f64>], z: &mut [Vector3<f64>]);
}

/// Inverse diagonal blocks.
#[derive(Clone, Debug, Default)]
pub struct BlockJacobi {
    inverse: Vec<Matrix3<f64>>,
}

impl BlockJacobi {
    /// Of given inverse blocks.
    pub fn from_inverse(inverse: Vec<Matrix3<f64>>) -> Self {
        Self { inverse }
    }

    /// Of the sum of matrices of one size.
    pub fn new(matrices: &[&BlockMatrix]) -> Self {
        let size = matrices.first().map_or(0, |m| m.pattern().size());
        let block = |i: usize| {
            let sum = matrices
                .iter()
                .fold(Matrix3::zeros(), |sum, m| sum + m.diagonal(i));
            sum.try_inverse().unwrap_or_else(Matrix3::identity)
        };
        Self {
            inverse: (0..size).map(block).collect(),
        }
    }
}

impl Preconditioner for BlockJacobi {
    fn apply(&mut self, r: &[Vector3<f64>], z: &mut [Vector3<f64>]) {
        for ((z, r), m) in z.iter_mut().zip(r).zip(&self.inverse) {
            *z = m * r;
        }
    }
}

/// Two levels added: inverse diagonal blocks, and the inverse on a coarse space.
#[derive(Debug)]
pub struct TwoLevel<'a> {
    fine: BlockJacobi,
    coarse: &'a mut CoarseSpace,
}

impl<'a> TwoLevel<'a> {
    /// Joins the levels; the coarse space is factored already.
    pub fn new(fine: BlockJacobi, coarse: &'a mut CoarseSpace) -> Self {
        Self { fine, coarse }
    }
}

impl Preconditioner for TwoLevel<'_> {
    fn apply(&mut self, r: &[Vector3<f64>], z: &mut [Vector3<f64>]) {
        self.fine.apply(r, z);
        self.coarse.add(r, z);
    }
}
