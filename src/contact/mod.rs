//! Candidate pairs, continuous collision, distances and contact energies between moving triangles; it never steps time.

mod depth_maps;
mod surface;

pub use depth_maps::{DepthMaps, MapView};
pub use surface::{Closest, Part, SurfaceFrame, SurfaceModel};
