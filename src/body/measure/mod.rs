//! Measurements of a body for choosing sizes.

mod section;
mod tape;

pub use tape::{MeasureError, Measurements, measure};
