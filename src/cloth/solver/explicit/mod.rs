//! Explicit substeps: the default solver.
//!
//! Membrane forces are tensions along edges, coupled within each triangle so that they equal the sheet's Hooke law
//! (Delingette 2008, "triangular biquadratic springs", here in lengths instead of squares, so that stiffness does not
//! grow with stretch). Without the coupling this is the paper's mass-spring model. A substep is symplectic Euler on
//! accelerations that are filtered over neighbours, which gives the finest waves more inertia and so allows
//! longer steps (`mass_filter.rs`); elements still too stiff for the step are softened when the garment is made, and counted.

mod active_set;
mod blocks;
mod contact;
mod fold_limit;
mod halo;
mod kernels;
mod mass_filter;
mod patch_model;
mod patch_state;
mod simd;
mod stability;
mod stable_sheet;

pub use contact::{ContactPlane, Pin};
pub use fold_limit::FoldLimit;
pub use halo::HaloExchange;
pub use kernels::Substep;
pub use patch_model::PatchModel;
pub use patch_state::{Exemptions, PatchState, V4};
pub use stable_sheet::{StableSheet, StepSpec, triangles};

#[cfg(test)]
mod stress;
#[cfg(test)]
mod tests;
