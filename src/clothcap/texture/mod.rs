//! Texture of a captured garment: an atlas of flat charts over its surface, and an image painted from the scans' points.

mod atlas;
mod charts;
mod image;
mod packing;
mod paint;
#[cfg(test)]
mod tests;

pub use atlas::{AtlasSize, Texel, TextureAtlas};
pub use image::GarmentTexture;
pub(super) use paint::ScanPaint;
