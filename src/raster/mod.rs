//! Meshes to depth, colour and id images on the CPU: the fast path without a GPU, and the judge of the GPU.

mod reference;
mod view;

pub use reference::rasterise_reference;
pub use view::{View, VisibilityBuffer};
