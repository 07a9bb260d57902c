//! Class distribution of each cell of a person.

/// Class distribution of each cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClassMap {
    classes: usize,
    shares: Vec<f32>,
}

impl ClassMap {
    /// Forgets all shares; so many cells.
    pub(super) fn clear(&mut self, classes: usize, cells: usize) {
        self.classes = classes;
        self.shares.clear();
        self.shares.resize(classes * cells, 0.0);
    }
    /// Shares of the `i`-th cell.
    pub(super) fn shares_mut(&mut self, i: usize) -> &mut [f32] {
        &mut self.shares[i * self.classes..(i + 1) * self.classes]
    }
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
    /// Shares of all classes at the `i`-th cell, shape `[classes]`; their sum is the probability that it shows the person, 0
    /// for a cell without reading.
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
