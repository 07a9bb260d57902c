//! Texture of a captured garment: an atlas of flat charts over its surface, and an image painted from the scans' points.

pub(crate) mod atlas;
pub(crate) mod charts;
mod image;
mod packing;
pub(crate) mod paint;
#[cfg(test)]
mod tests;

pub use atlas::{AtlasSize, Texel, TextureAtlas};
pub use image::GarmentTexture;
pub(super) use paint::ScanPaint;
