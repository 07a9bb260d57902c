//! Garments made by others, as ours.

mod garmentcode;
mod mesh;

pub use garmentcode::from_garmentcode;
pub use mesh::{MeshGarment, from_mesh};
