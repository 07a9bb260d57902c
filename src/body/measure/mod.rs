//! Measurements of a body for choosing sizes.

mod section;
pub(crate) mod tape;

pub use tape::{MeasureError, Measurements, measure};
