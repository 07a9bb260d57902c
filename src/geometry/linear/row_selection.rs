//! Some rows of a block system, numbered anew.

use nalgebra::Vector3;

/// Number of a row that is not selected.
const NONE: u32 = u32::MAX;

/// Selection of the rows of a system, in their order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RowSelection {
    rows: Vec<u32>,
    numbers: Vec<u32>,
}

impl RowSelection {
    /// Rows for which `is_selected` holds, shape `[size]`.
    pub fn new(is_selected: impl IntoIterator<Item = bool>) -> Self {
        let mut selection = Self::default();
        for (row, is_selected) in is_selected.into_iter().enumerate() {
            let number = selection.rows.len() as u32;
            selection
                .numbers
                .push(if is_selected { number } else { NONE });
            if is_selected {
                selection.rows.push(row as u32);
            }
        }
        selection
    }

    /// Selected rows, ascending.
    pub fn rows(&self) -> &[u32] {
        &self.rows
    }

    /// Number of a row among those selected.
    pub fn number(&self, row: u32) -> Option<u32> {
        let number = self.numbers.get(row as usize).copied();
        number.filter(|n| *n != NONE)
    }

    /// Values of the selected rows.
    pub fn gather(&self, all: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        self.rows.iter().map(|row| all[*row as usize]).collect()
    }

    /// Puts values of the selected rows back in their places.
    pub fn scatter(&self, selected: &[Vector3<f64>], all: &mut [Vector3<f64>]) {
        for (row, value) in self.rows.iter().zip(selected) {
            all[*row as usize] = *value;
        }
    }
}
