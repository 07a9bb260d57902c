//! Parametric garments of the library.

mod catalogue;
mod draft;
pub(crate) mod dress;
pub(crate) mod skirt;
pub(crate) mod top;
pub(crate) mod trousers;

pub use catalogue::{dye, names, pattern};
