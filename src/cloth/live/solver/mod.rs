//! Solver kernels: explicit substeps of patches, XPBD constraints.

pub mod explicit;
pub mod xpbd;
