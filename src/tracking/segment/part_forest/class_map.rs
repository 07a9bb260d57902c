//! Class distribution of each cell of a person.

/// Class distribution of each cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClassMap {
    pub(super) classes: usize,
    pub(super) shares: Vec<f32>,
    /// Sums of the ways to the joint times their shares, shape `[cells × classes]`: right, down, away, `OFFSET_UNIT`s.
    pub(super) offsets: Vec<[f32; 3]>,
}

impl ClassMap {
    /// Number of classes.
    pub fn classes(&self) -> usize {
        self.classes
    }
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.shares.len() / self.classes.max(1)
    }
    /// Has no cells.
    pub fn is_empty(&self) -> bool {
        self.shares.is_empty()
    }
    /// Shares of all classes at the `i`-th cell, shape `[classes]`; their sum is 1, or 0 for a cell without reading.
    pub fn shares(&self, i: usize) -> &[f32] {
        &self.shares[i * self.classes..(i + 1) * self.classes]
    }
    /// Class of the largest share at the `i`-th cell, the first of equals; `None` for a cell without reading.
    pub fn best(&self, i: usize) -> Option<u8> {
        let (mut best, mut most) = (None, 0.0);
        for (c, s) in self.shares(i).iter().enumerate() {
            if *s > most {
                (best, most) = (Some(c as u8), *s);
            }
        }
        best
    }
}
