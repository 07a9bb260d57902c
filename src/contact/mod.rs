//! Candidate pairs, continuous collision, distances and contact energies between moving triangles; it never steps time.

mod across;
mod apart;
mod astray;
mod buried;
mod creases;
mod depth_maps;
mod near_skin;
mod surface;
mod winding;

pub use apart::Apart;
pub use buried::Buried;
pub use creases::Crease;
pub use depth_maps::{DepthMaps, MapDetail, MapView};
pub use near_skin::{Near, NearSkin};
pub use surface::{Closest, Part, SurfaceFrame, SurfaceModel};
