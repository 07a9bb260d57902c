//! wgpu twins of `raster` and `composite`, same inputs and outputs; the only module naming wgpu.
//!
//! The card draws and shades; patches of occluders are decided by the same code as in [`crate::composite`], from a
//! depth image read back in between. On software adapters this is slower than [`crate::composite::render`]:
//! [`choose`] says which to use.

mod buffers;
mod probe;
mod renderer;
mod targets;

pub use probe::{AdapterReport, GpuError, Prefer, adapters, choose};
pub use renderer::Renderer;
