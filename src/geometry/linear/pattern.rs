//! Sparsity pattern of a symmetric matrix: built once, filled many times.

use super::LinearError;

/// Lower triangle in compressed columns; every diagonal entry is present.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SymmetricPattern {
    pub(super) columns: Vec<u32>,
    pub(super) rows: Vec<u32>,
    size: usize,
}

impl SymmetricPattern {
    /// Union of the diagonal and the given `(row, column)` pairs of either triangle.
    ///
    /// # Errors
    /// An index beyond `size`, or more entries than 32 bits count.
    pub fn new(
        size: usize,
        entries: impl IntoIterator<Item = (u32, u32)>,
    ) -> Result<Self, LinearError> {
        let mut all: Vec<(u32, u32)> = (0..size as u32).map(|i| (i, i)).collect();
        for (r, c) in entries {
            if r as usize >= size || c as usize >= size {
                return Err(LinearError::OutOfRange {
                    row: r as usize,
                    column: c as usize,
                    size,
                });
            }
            all.push((r.min(c), r.max(c))); // (column, row) of the lower triangle
        }
        all.sort_unstable();
        all.dedup();
        if u32::try_from(all.len()).is_err() {
            return Err(LinearError::TooLarge(format!("{} entries", all.len())));
        }
        let mut columns = vec![0u32; size + 1];
        for &(c, _) in &all {
            columns[c as usize + 1] += 1;
        }
        for i in 0..size {
            columns[i + 1] += columns[i];
        }
        Ok(Self {
            columns,
            rows: all.into_iter().map(|(_, r)| r).collect(),
            size,
        })
    }
    /// Pattern from compressed columns whose rows are sorted and begin with the diagonal.
    pub(super) fn from_sorted(columns: Vec<u32>, rows: Vec<u32>, size: usize) -> Self {
        Self {
            columns,
            rows,
            size,
        }
    }
    /// Rows (and columns).
    pub fn size(&self) -> usize {
        self.size
    }
    /// Stored entries of the lower triangle.
    pub fn entries(&self) -> usize {
        self.rows.len()
    }
    /// Storage index of entry (row, column) of either triangle; `None` if it is not in the pattern.
    pub fn slot(&self, row: u32, column: u32) -> Option<usize> {
        let (c, r) = (row.min(column) as usize, row.max(column));
        if c >= self.size {
            return None;
        }
        let (from, to) = (self.columns[c] as usize, self.columns[c + 1] as usize);
        self.rows[from..to].binary_search(&r).ok().map(|k| from + k)
    }
    /// Storage index of the diagonal entry of a row.
    pub fn diagonal_slot(&self, row: usize) -> usize {
        // The diagonal is the smallest row of its column in the lower triangle.
        self.columns[row] as usize
    }
    /// Product `y = A x` for stored `values`, three right-hand sides at once. Shapes `[size]`.
    pub fn multiply(&self, values: &[f64], x: &[[f64; 3]], y: &mut Vec<[f64; 3]>) {
        y.clear();
        y.resize(self.size, [0.0; 3]);
        for c in 0..self.size {
            for k in self.columns[c] as usize..self.columns[c + 1] as usize {
                let r = self.rows[k] as usize;
                for d in 0..3 {
                    y[r][d] += values[k] * x[c][d];
                    if r != c {
                        y[c][d] += values[k] * x[r][d];
                    }
                }
            }
        }
    }
}
