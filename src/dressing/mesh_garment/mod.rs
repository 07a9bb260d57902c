//! Garments made elsewhere as meshes: their pieces of cloth, how each is held, and the body that they were made on.

mod anchors;
pub(crate) mod classifier;
pub(crate) mod grading;
mod layers;
mod painting;
mod piece;
mod read;
pub(crate) mod sizing;
mod skin_lift;
mod surface;

pub use read::MeshGarment;
