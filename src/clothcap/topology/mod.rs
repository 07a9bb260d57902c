//! Surfaces of clothed templates: legs apart as the body's, or joined in one tube as skirts and dresses join them.

mod cloth_template;
mod meridian;
mod strip;

pub use cloth_template::{ClothTemplate, LegTopology};
