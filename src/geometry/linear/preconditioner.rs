//! Preconditioners of conjugate gradients on blocks of three.

use super::{BlockMatrix, CoarseSpace};
use crate::par::{Par, for_chunks, map_into};
use nalgebra::{Matrix3, Vector3};

/// Blocks that one thread takes at a time.
const CHUNK: usize = 1024;

/// Approximate inverse of a matrix, symmetric and positive.
pub trait Preconditioner {
    /// Replaces `z` with the approximate solution of `A z = r`.
    fn apply(&mut self, par: Par, r: &[Vector3<f64>], z: &mut [Vector3<f64>]);
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
    pub fn new(par: Par, matrices: &[&BlockMatrix]) -> Self {
        let size = matrices.first().map_or(0, |m| m.pattern().size());
        let block = |i: usize| {
            let sum = matrices
                .iter()
                .fold(Matrix3::zeros(), |sum, m| sum + m.diagonal(i));
            sum.try_inverse().unwrap_or_else(Matrix3::identity)
        };
        let mut inverse = Vec::new();
        map_into(par, size, CHUNK, &mut inverse, block);
        Self { inverse }
    }
}

impl Preconditioner for BlockJacobi {
    fn apply(&mut self, par: Par, r: &[Vector3<f64>], z: &mut [Vector3<f64>]) {
        for_chunks(par, z, CHUNK, |start, chunk| {
            let known = r[start..].iter().zip(&self.inverse[start..]);
            for (z, (r, m)) in chunk.iter_mut().zip(known) {
                *z = m * r;
            }
        });
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
    fn apply(&mut self, par: Par, r: &[Vector3<f64>], z: &mut [Vector3<f64>]) {
        self.fine.apply(par, r, z);
        self.coarse.add(par, r, z);
    }
}
