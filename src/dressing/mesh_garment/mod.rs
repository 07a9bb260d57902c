//! Garments made elsewhere as meshes: their pieces of cloth, how each is held, and the body that they were made on.

mod anchors;
mod classifier;
mod layers;
mod piece;
mod read;
mod surface;

pub use read::MeshGarment;
