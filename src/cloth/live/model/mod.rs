//! A garment as a mechanical system: sheet, membrane, bending, and its partition into bands and islands.

pub(super) mod bands;
pub(crate) mod bending;
pub(crate) mod membrane;
pub(crate) mod partition;
mod resolution;
pub(crate) mod sheet;

pub use bending::Hinge;
pub use membrane::Membrane;
pub use resolution::BendingResolution;
pub use sheet::{Element, Sheet};
