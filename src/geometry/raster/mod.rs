//! Meshes to depth, colour and id images on the CPU: the fast path without a GPU, and the judge of the GPU.
//!
//! Corners are snapped to 1/256 pixel, so coverage is integer arithmetic: exact, watertight along shared
//! edges, and the same in [`rasterise`], in [`rasterise_reference`] and at any thread count.

mod buffer;
mod clip;
mod faces;
pub(crate) mod fast;
pub(crate) mod hiz;
mod interpolate;
mod kernel;
mod options;
mod reference;
mod screen;
mod view;

pub use buffer::VisibilityBuffer;
pub use fast::{LayeredMesh, rasterise, rasterise_layers, rasterise_with};
pub use interpolate::{barycentrics, interpolate};
pub use options::{Cull, Options};
pub use reference::rasterise_reference;
pub use view::View;
