//! Under construction.
pub mod page;
