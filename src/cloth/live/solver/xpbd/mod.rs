//! Extended position-based dynamics in small steps (Macklin et al. 2016, 2019).

pub mod constraints;
mod sheet;

pub(super) use sheet::solver;
