//! Garments from other tools.

pub(crate) mod coarsen;
#[cfg(test)]
mod exporter_tests;
mod file;
pub(crate) mod garmentcode;
mod mesh;
mod settings;

pub use super::flat_triangle::{unfold, widened};
pub use coarsen::{CoarsenSettings, coarsen, median_edge};
pub use file::{MeshFile, read_mesh, some_faces, split};
pub use garmentcode::from_garmentcode;
pub use mesh::{ImportedMesh, from_mesh, panels_in_metres};
pub use settings::ImportSettings;
