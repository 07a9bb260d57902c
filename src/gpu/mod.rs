//! wgpu twins of `raster` and `composite`, same inputs and outputs; the only module naming wgpu.
