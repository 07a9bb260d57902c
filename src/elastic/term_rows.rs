//! Lists of terms, one list a row, in one array.

/// Terms by row.
#[derive(Clone, Debug)]
pub(super) struct TermRows<T> {
    offsets: Vec<u32>,
    terms: Vec<T>,
}

impl<T> Default for TermRows<T> {
    /// No row.
    fn default() -> Self {
        Self {
            offsets: vec![0],
            terms: Vec::new(),
        }
    }
}

impl<T> TermRows<T> {
    /// Sorts terms by row, stable.
    pub(super) fn new(rows: usize, mut all: Vec<(u32, T)>) -> Self {
        all.sort_by_key(|(row, _)| *row);
        let mut offsets = vec![0u32; rows + 1];
        for (row, _) in &all {
            offsets[*row as usize + 1] += 1;
        }
        for i in 0..rows {
            offsets[i + 1] += offsets[i];
        }
        Self {
            offsets,
            terms: all.into_iter().map(|(_, t)| t).collect(),
        }
    }

    pub(super) fn row(&self, i: usize) -> &[T] {
        &self.terms[self.offsets[i] as usize..self.offsets[i + 1] as usize]
    }
}
