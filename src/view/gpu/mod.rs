//! wgpu twins of `raster` and `composite`, same inputs and outputs; the only module naming wgpu.
//!
//! The card rasterises and shades; visibility is resolved by the code of [`crate`] from a depth image read
//! back in between. Software adapters are slower than [`crate::render`]: [`choose`] selects the renderer.

mod adapter;
mod buffers;
pub(crate) mod choice;
mod passes;
pub(crate) mod pipelines;
mod readback;
mod renderer;
mod targets;

pub use adapter::{AdapterReport, GpuError, adapters};
pub use choice::{Prefer, choose};
pub use renderer::Renderer;
