//! Parametric garments of the library.

mod catalogue;
mod draft;
mod dress;
mod skirt;
mod top;
mod trousers;

pub use catalogue::{dye, names, pattern};
