//! A symmetric block matrix in single precision for the products of an iteration, which memory bounds.

use super::{BlockMatrix, BlockPattern};
use crate::par::{Par, for_chunks};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// Rows that one thread takes at a time.
const ROWS: usize = 256;
/// Numbers of a block.
const BLOCK: usize = 9;
/// Numbers read at a block, the start of the next ones included: its last column as four lanes.
const READ: usize = 10;

/// Copy of a [`BlockMatrix`]. Off-diagonal blocks are rounded to single precision; diagonal blocks stay in double precision
/// and take up what the rounding would change of the sums of rows, so that translations keep their energy.
#[derive(Clone, Debug, Default)]
pub struct SingleMatrix {
    pattern: Arc<BlockPattern>,
    /// Blocks column by column, in the order of the pattern; zero on the diagonal.
    values: Vec<f32>,
    diagonal: Vec<Matrix3<f64>>,
}

impl SingleMatrix {
    /// Replaces this matrix with a copy of `of`.
    pub fn copy(&mut self, par: Par, of: &BlockMatrix) {
        let pattern = of.pattern();
        self.pattern = Arc::clone(pattern);
        self.values
            .resize(BLOCK * pattern.blocks() + READ - BLOCK, 0.0);
        for_chunks(par, &mut self.values, BLOCK * ROWS, |start, chunk| {
            for (k, value) in chunk.chunks_exact_mut(BLOCK).enumerate() {
                let block = of.block(start / BLOCK + k);
                value
                    .iter_mut()
                    .zip(block.iter())
                    .for_each(|(v, b)| *v = *b as f32);
            }
        });
        self.diagonal.resize(pattern.size(), Matrix3::zeros());
        let values = &self.values;
        for_chunks(par, &mut self.diagonal, ROWS, |start, chunk| {
            for (k, diagonal) in chunk.iter_mut().enumerate() {
                let row = start + k;
                let mut lost = Matrix3::zeros();
                for slot in pattern
                    .slots(row)
                    .filter(|s| *s != pattern.diagonal_slot(row))
                {
                    let rounded = &values[BLOCK * slot..BLOCK * (slot + 1)];
                    let rounded = Matrix3::from_iterator(rounded.iter().map(|v| f64::from(*v)));
                    lost += of.block(slot) - rounded;
                }
                *diagonal = of.diagonal(row) + (lost + lost.transpose()) * 0.5;
            }
        });
        for row in 0..pattern.size() {
            let first = BLOCK * pattern.diagonal_slot(row);
            self.values[first..first + BLOCK].fill(0.0);
        }
    }

    /// Product `y += A x`, shapes `[size]`; the bits do not depend on the threads.
    pub fn multiply_add(&self, par: Par, x: &[Vector3<f64>], y: &mut [Vector3<f64>]) {
        for_chunks(par, y, ROWS, |start, rows| {
            for (k, sum) in rows.iter_mut().enumerate() {
                let row = start + k;
                let mut lanes = [0.0f64; 4];
                for slot in self.pattern.slots(row) {
                    let x = &x[self.pattern.column(slot) as usize];
                    let values = &self.values[BLOCK * slot..BLOCK * slot + READ];
                    for (column, x) in x.iter().enumerate() {
                        for (lane, v) in lanes.iter_mut().zip(&values[3 * column..3 * column + 4]) {
                            *lane += f64::from(*v) * x;
                        }
                    }
                }
                *sum += self.diagonal[row] * x[row] + Vector3::new(lanes[0], lanes[1], lanes[2]);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Path of blocks with a weight of `at_rest` at each vertex.
    fn path(n: usize, at_rest: f64) -> BlockMatrix {
        let pattern = BlockPattern::new(n, (1..n as u32).map(|i| (i - 1, i))).expect("pattern");
        let mut matrix = BlockMatrix::zeros(Arc::new(pattern));
        let mut add = |a: u32, b: u32, block: Matrix3<f64>| {
            let slot = matrix.pattern().slot(a, b).expect("in pattern");
            *matrix.block_mut(slot) += block;
        };
        let k = Matrix3::new(1.0, 0.2, 0.3, 0.2, 1.1, -0.4, 0.3, -0.4, 0.9) * (1e4 / 3.0);
        for i in 1..n as u32 {
            add(i, i, k);
            add(i - 1, i - 1, k);
            add(i - 1, i, -k);
            add(i, i - 1, -k);
        }
        (0..n as u32).for_each(|i| add(i, i, Matrix3::identity() * at_rest));
        matrix
    }

    #[test]
    fn products_are_those_of_the_matrix_and_translations_keep_their_energy() {
        let matrix = path(700, 1e-6);
        let mut single = SingleMatrix::default();
        single.copy(Par::Seq, &matrix);
        let x: Vec<Vector3<f64>> = (0..700)
            .map(|i| Vector3::new((i as f64).sin(), 1.0, i as f64 % 5.0))
            .collect();
        let mut exact = vec![Vector3::zeros(); 700];
        matrix.multiply_add(Par::Seq, &x, &mut exact);
        let product = |par, x: &[Vector3<f64>]| {
            let mut y = vec![Vector3::zeros(); x.len()];
            single.multiply_add(par, x, &mut y);
            y
        };
        let near = product(Par::Seq, &x);
        assert_eq!(near, product(Par::Rayon, &x));
        for (a, b) in exact.iter().zip(&near) {
            assert!((a - b).norm() < 1e-6 * 1e5, "{a} {b}");
        }
        let moved = vec![Vector3::new(1.0, -2.0, 0.5); 700];
        for y in product(Par::Seq, &moved) {
            assert!((y - moved[0] * 1e-6).norm() < 1e-10, "{y}");
        }
    }
}
