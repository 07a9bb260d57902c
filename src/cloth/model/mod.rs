//! A garment as a mechanical system: sheet, membrane, bending, and its partition.

pub mod membrane;
pub(crate) mod partition;
mod sheet;

pub use sheet::{Element, Hinge, Sheet};
