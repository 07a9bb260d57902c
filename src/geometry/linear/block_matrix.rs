//! Symmetric sparse matrix of 3 × 3 blocks: one row and column of blocks a vertex.

use super::{LinearError, RowSelection, SymmetricPattern};
use crate::par::{Par, for_chunks};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// Rows that one thread multiplies in a row.
const ROW_CHUNK: usize = 256;

/// Sparsity of a [`BlockMatrix`]: compressed rows of both triangles; every diagonal block is present.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BlockPattern {
    rows: Vec<u32>,
    columns: Vec<u32>,
    diagonal: Vec<u32>,
}

impl BlockPattern {
    /// Union of the diagonal and the given pairs, each with its transpose.
    ///
    /// # Errors
    /// An index beyond `size`, or more blocks than 32 bits count.
    pub fn new(
        size: usize,
        pairs: impl IntoIterator<Item = (u32, u32)>,
    ) -> Result<Self, LinearError> {
        let mut lists: Vec<Vec<u32>> = (0..size as u32).map(|i| vec![i]).collect();
        for (row, column) in pairs {
            if row as usize >= size || column as usize >= size {
                return Err(LinearError::OutOfRange {
                    row: row as usize,
                    column: column as usize,
                    size,
                });
            }
            lists[row as usize].push(column);
            lists[column as usize].push(row);
        }
        let mut pattern = Self {
            rows: vec![0],
            ..Self::default()
        };
        for (row, list) in lists.iter_mut().enumerate() {
            list.sort_unstable();
            list.dedup();
            let before = list.partition_point(|c| (*c as usize) < row);
            pattern
                .diagonal
                .push((pattern.columns.len() + before) as u32);
            pattern.columns.extend_from_slice(list);
            let end = u32::try_from(pattern.columns.len())
                .map_err(|_| LinearError::TooLarge("blocks of a matrix".into()))?;
            pattern.rows.push(end);
        }
        Ok(pattern)
    }

    /// The same with `more` rows of a diagonal block each; storage indices of the others stay.
    pub fn extended(&self, more: usize) -> Self {
        let mut all = self.clone();
        for row in self.size()..self.size() + more {
            all.diagonal.push(all.columns.len() as u32);
            all.columns.push(row as u32);
            all.rows.push(all.columns.len() as u32);
        }
        all
    }

    /// Rows of blocks.
    pub fn size(&self) -> usize {
        self.diagonal.len()
    }

    /// Stored blocks of both triangles.
    pub fn blocks(&self) -> usize {
        self.columns.len()
    }

    /// Storage index of the block (row, column); `None` if it is not in the pattern.
    pub fn slot(&self, row: u32, column: u32) -> Option<usize> {
        let (from, to) = self.row_range(row as usize)?;
        let found = self.columns[from..to].binary_search(&column).ok()?;
        Some(from + found)
    }

    /// Storage index of a diagonal block.
    pub fn diagonal_slot(&self, row: usize) -> usize {
        self.diagonal[row] as usize
    }

    /// Storage indices of the blocks of a row.
    pub(super) fn slots(&self, row: usize) -> std::ops::Range<usize> {
        self.rows[row] as usize..self.rows[row + 1] as usize
    }

    /// Column of a block.
    pub(super) fn column(&self, slot: usize) -> u32 {
        self.columns[slot]
    }

    /// Columns of the blocks of a row, ascending.
    pub fn neighbours(&self, row: usize) -> &[u32] {
        &self.columns[self.slots(row)]
    }

    /// Row, column and storage index of the blocks of a row.
    fn row(&self, row: usize) -> impl Iterator<Item = (u32, u32, usize)> {
        self.slots(row)
            .map(move |slot| (row as u32, self.columns[slot], slot))
    }

    fn row_range(&self, row: usize) -> Option<(usize, usize)> {
        Some((
            *self.rows.get(row)? as usize,
            *self.rows.get(row + 1)? as usize,
        ))
    }
}

/// Blocks on a [`BlockPattern`].
#[derive(Clone, Debug, Default)]
pub struct BlockMatrix {
    pattern: Arc<BlockPattern>,
    blocks: Vec<Matrix3<f64>>,
}

impl BlockMatrix {
    /// Zero matrix.
    pub fn zeros(pattern: Arc<BlockPattern>) -> Self {
        Self {
            blocks: vec![Matrix3::zeros(); pattern.blocks()],
            pattern,
        }
    }

    /// Sum of matrices of one size.
    ///
    /// # Errors
    /// Different sizes, or too many blocks.
    pub fn sum(matrices: &[&Self]) -> Result<Self, LinearError> {
        let size = matrices.iter().map(|m| m.pattern.size()).max().unwrap_or(0);
        let pairs = matrices.iter().flat_map(|m| {
            let rows = (0..m.pattern.size()).flat_map(|row| m.pattern.row(row));
            rows.map(|(row, column, _)| (row, column))
        });
        let mut sum = Self::zeros(Arc::new(BlockPattern::new(size, pairs)?));
        for m in matrices {
            for (row, column, slot) in (0..m.pattern.size()).flat_map(|row| m.pattern.row(row)) {
                if let Some(to) = sum.pattern.slot(row, column) {
                    sum.blocks[to] += m.blocks[slot];
                }
            }
        }
        Ok(sum)
    }

    /// Rows and columns of a selection; nothing of a matrix of size zero.
    pub fn selected(&self, selection: &RowSelection) -> Self {
        let mut pattern = BlockPattern {
            rows: vec![0],
            ..BlockPattern::default()
        };
        let mut blocks = Vec::new();
        let rows = selection.rows().iter().map(|row| *row as usize);
        for row in rows.filter(|row| *row < self.pattern.size()) {
            for (column, block) in self.row_blocks(row) {
                let Some(number) = selection.number(column) else {
                    continue;
                };
                if column as usize == row {
                    pattern.diagonal.push(blocks.len() as u32);
                }
                pattern.columns.push(number);
                blocks.push(*block);
            }
            pattern.rows.push(blocks.len() as u32);
        }
        let pattern = Arc::new(pattern);
        Self { pattern, blocks }
    }

    /// Pattern of the blocks.
    pub fn pattern(&self) -> &Arc<BlockPattern> {
        &self.pattern
    }

    /// Sets every block to zero.
    pub fn clear(&mut self) {
        self.blocks.fill(Matrix3::zeros());
    }

    /// Block at a storage index.
    pub(super) fn block(&self, slot: usize) -> &Matrix3<f64> {
        &self.blocks[slot]
    }

    /// Block at a storage index, to change.
    pub fn block_mut(&mut self, slot: usize) -> &mut Matrix3<f64> {
        &mut self.blocks[slot]
    }

    /// Diagonal block of a row.
    pub fn diagonal(&self, row: usize) -> &Matrix3<f64> {
        &self.blocks[self.pattern.diagonal_slot(row)]
    }

    /// Column and block of each block of a row.
    pub fn row_blocks(&self, row: usize) -> impl Iterator<Item = (u32, &Matrix3<f64>)> {
        let range = self.pattern.slots(row);
        let columns = &self.pattern.columns[range.clone()];
        columns.iter().copied().zip(&self.blocks[range])
    }

    /// Product `y += A x`, shapes `[size]`; the bits do not depend on the threads.
    pub fn multiply_add(&self, par: Par, x: &[Vector3<f64>], y: &mut [Vector3<f64>]) {
        for_chunks(par, y, ROW_CHUNK, |start, rows| {
            for (k, sum) in rows.iter_mut().enumerate() {
                let row = start + k;
                for slot in self.pattern.slots(row) {
                    *sum += self.blocks[slot] * x[self.pattern.columns[slot] as usize];
                }
            }
        });
    }

    /// Lower triangle by scalars, three rows a block: pattern and values for a factorisation.
    ///
    /// # Errors
    /// More entries than 32 bits count.
    pub fn to_scalar(&self) -> Result<(SymmetricPattern, Vec<f64>), LinearError> {
        let size = self.pattern.size();
        let mut columns = vec![0u32; 3 * size + 1];
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        // Column c of the lower triangle is row c of the upper one, by symmetry.
        for block_column in 0..size {
            let range = self.pattern.diagonal_slot(block_column)
                ..self.pattern.rows[block_column + 1] as usize;
            for d in 0..3 {
                for slot in range.clone() {
                    let row = self.pattern.columns[slot];
                    let first = if row as usize == block_column { d } else { 0 };
                    for e in first..3 {
                        rows.push(3 * row + e as u32);
                        values.push(self.blocks[slot][(d, e)]);
                    }
                }
                columns[3 * block_column + d + 1] = u32::try_from(rows.len())
                    .map_err(|_| LinearError::TooLarge("entries of a matrix".into()))?;
            }
        }
        Ok((
            SymmetricPattern::from_sorted(columns, rows, 3 * size),
            values,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(n: usize) -> BlockMatrix {
        let pattern = BlockPattern::new(n, (1..n as u32).map(|i| (i - 1, i))).expect("pattern");
        let mut matrix = BlockMatrix::zeros(Arc::new(pattern));
        for i in 0..n as u32 {
            let slot = matrix.pattern.diagonal_slot(i as usize);
            *matrix.block_mut(slot) = Matrix3::identity() * 3.0;
            if i > 0 {
                let b = Matrix3::new(-1.0, 0.2, 0.0, 0.1, -0.8, 0.0, 0.0, 0.3, -1.0);
                let upper = matrix.pattern.slot(i - 1, i).expect("in pattern");
                *matrix.block_mut(upper) = b;
                let lower = matrix.pattern.slot(i, i - 1).expect("in pattern");
                *matrix.block_mut(lower) = b.transpose();
            }
        }
        matrix
    }

    #[test]
    fn scalar_form_has_the_same_product() {
        let matrix = path(40);
        let x: Vec<Vector3<f64>> = (0..40)
            .map(|i| Vector3::new((i as f64).sin(), 1.0, i as f64 % 5.0))
            .collect();
        let mut y = vec![Vector3::zeros(); 40];
        matrix.multiply_add(Par::Rayon, &x, &mut y);
        let (pattern, values) = matrix.to_scalar().expect("scalar");
        let flat: Vec<[f64; 3]> = x.iter().flat_map(|v| v.iter().map(|c| [*c; 3])).collect();
        let mut back = Vec::new();
        pattern.multiply(&values, &flat, &mut back);
        for (i, v) in y.iter().enumerate() {
            for d in 0..3 {
                assert!((v[d] - back[3 * i + d][0]).abs() < 1e-12, "row {i}");
            }
        }
        assert!(BlockPattern::new(2, [(0, 7)]).is_err());
    }

    /// Products with vectors that are zero elsewhere.
    #[test]
    fn selected_rows_have_the_same_products() {
        let matrix = path(40);
        let selection = RowSelection::new((0..40).map(|i| i % 5 != 2));
        let some = matrix.selected(&selection);
        assert_eq!(some.pattern().size(), 32);
        let x: Vec<Vector3<f64>> = (0..32)
            .map(|i| Vector3::new(1.0, (i as f64).sin(), 0.5))
            .collect();
        let (mut all, mut y) = (vec![Vector3::zeros(); 40], vec![Vector3::zeros(); 32]);
        selection.scatter(&x, &mut all);
        some.multiply_add(Par::Seq, &x, &mut y);
        let mut expected = vec![Vector3::zeros(); 40];
        matrix.multiply_add(Par::Seq, &all, &mut expected);
        assert_eq!(y, selection.gather(&expected));
        for (i, row) in selection.rows().iter().enumerate() {
            assert_eq!(some.diagonal(i), matrix.diagonal(*row as usize));
        }
        let none = BlockMatrix::default().selected(&selection);
        assert_eq!(none.pattern().size(), 0);
    }
}
