//! Explicit substeps: the default solver.
//!
//! Membrane forces are tensions along edges, coupled within each triangle so that they equal the sheet's Hooke law
//! (Delingette 2008, in lengths instead of squares, so that stiffness does not grow with stretch). Without the coupling
//! this is the paper's mass-spring model. A substep is symplectic Euler on accelerations that pass a mass filter, which
//! allows longer steps. Elements that are still too stiff are softened when the garment is made, and counted.

mod active_set;
mod air;
mod bending;
mod blocks;
mod constraint;
mod contact;
mod dispatch;
pub(crate) mod edge_stiffness;
mod elastic;
mod elements;
mod filtering;
pub(crate) mod halo;
mod integrate;
pub(crate) mod mass_filter;
mod patch_compile;
mod patch_model;
mod patch_state;
pub(crate) mod simd;
pub(crate) mod stability;
mod stable_sheet;
pub(crate) mod substeps;
#[cfg(test)]
mod test_sheets;
#[cfg(test)]
mod tests;
mod vec4;

pub use constraint::{ContactPlane, Pin};
pub use contact::{Recovery, VertexPlanes};
pub use patch_model::PatchModel;
pub use patch_state::{Exemptions, PatchState, Substep};
pub use stable_sheet::{StableSheet, StepSpec};
pub use substeps::run_substeps;
pub use vec4::V4;
