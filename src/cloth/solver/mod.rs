//! Solvers: explicit substeps for real time, implicit ones to compare with.

pub mod explicit;
pub mod implicit;
