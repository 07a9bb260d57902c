//! Garments made elsewhere as meshes: their pieces of cloth, how each is held, and the body that they were made on.

mod anchors;
mod classifier;
mod grading;
mod layers;
mod painting;
mod piece;
mod read;
mod sizing;
mod skin_lift;
mod surface;

pub use read::MeshGarment;
