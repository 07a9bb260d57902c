//! Scenes as plain data: one sheet, pins, moving primitives. `tryon simulate` runs them and benchmarks compare them.

mod collider_file;
mod description;
pub(crate) mod file;
mod run;

pub use super::integrators::collider::{Collider, Primitive};
pub use super::integrators::{Method, RunConfig};
pub use description::{Scene, SceneError};
pub use file::{load, parse};
pub use run::{RunReport, run, write_positions};
