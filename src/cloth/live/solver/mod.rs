//! Solver kernels: explicit substeps of patches.

pub mod explicit;
