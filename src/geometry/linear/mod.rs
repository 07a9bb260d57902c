//! Sparse symmetric systems: assembly, factorisation, preconditioned iteration, with a report of how it went.

pub(crate) mod block_matrix;
pub(crate) mod cholesky;
mod coarse_space;
pub(crate) mod conjugate_gradient;
mod pattern;
mod preconditioner;
mod row_selection;
mod single_matrix;

pub use block_matrix::{BlockMatrix, BlockPattern};
pub use cholesky::{Factor, SymbolicFactor};
pub use coarse_space::CoarseSpace;
pub use conjugate_gradient::{CgAccuracy, CgReport, CgSettings, conjugate_gradient};
pub use pattern::SymmetricPattern;
pub use preconditioner::{BlockJacobi, Preconditioner, TwoLevel};
pub use row_selection::RowSelection;
pub use single_matrix::SingleMatrix;

/// Error of a linear system.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LinearError {
    /// A row or column beyond the size.
    #[error("entry ({row}, {column}) lies outside a system of size {size}")]
    OutOfRange {
        /// Row.
        row: usize,
        /// Column.
        column: usize,
        /// Rows of the system.
        size: usize,
    },
    /// A pivot that is not positive.
    #[error("the matrix is not positive definite (pivot {pivot} in elimination order)")]
    NotPositiveDefinite {
        /// Position in elimination order.
        pivot: usize,
    },
    /// Too large for 32-bit indices or for the memory.
    #[error("the system is too large: {0}")]
    TooLarge(String),
}

impl LinearError {
    /// Nothing where a pivot was not positive, the error otherwise.
    pub fn unless_indefinite(self) -> Result<(), Self> {
        match self {
            Self::NotPositiveDefinite { .. } => Ok(()),
            other => Err(other),
        }
    }
}
