//! Garments made by others, as ours.

mod coarsen;
mod file;
mod garmentcode;
mod mesh;

pub use coarsen::{coarsen, median_edge};
pub use file::{MeshFile, read_mesh, some_faces, split};
pub use garmentcode::from_garmentcode;
pub(crate) use mesh::unfold;
pub use mesh::{ImportedMesh, from_mesh, panels_in_metres};
