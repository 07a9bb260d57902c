//! Scenes as plain data: one sheet, pins, moving primitives. `tryon simulate` runs them by either solver.

pub(crate) mod collider;
mod collider_file;
mod description;
pub(crate) mod fabric_test;
pub(crate) mod file;
pub(crate) mod fine_run;
pub(crate) mod live_run;
mod solid_mesh;
mod solids;

pub use collider::{Collider, Primitive};
pub use description::{Scene, SceneError};
pub use fabric_test::{FabricReading, FabricSolver, FabricTest, FabricTestReport, FabricTrial};
pub use file::{load, parse};
pub use fine_run::OfflineScene;
pub use live_run::{RunReport, run, write_positions};
