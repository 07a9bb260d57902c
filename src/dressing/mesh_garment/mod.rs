//! Garments made elsewhere as meshes: their pieces of cloth, how each is held, and the body that they were made on.

mod anchors;
mod avatar;
pub(crate) mod classifier;
mod file_part;
pub(crate) mod grading;
mod layers;
mod linings;
mod painting;
mod piece;
mod read;
pub(crate) mod sizing;
mod skin_lift;
mod surface;
mod wrap;

pub use read::{GarmentFile, MeshGarment};
