//! Many small explicit steps: the default solver.
//!
//! Membrane forces are tensions along edges, coupled within each triangle so that they equal the sheet's Hooke law
//! (Delingette 2008, "triangular biquadratic springs", here in lengths instead of squares, so that stiffness does not
//! grow with stretch). Without the coupling this is the paper's mass-spring model. A step is symplectic Euler on
//! accelerations that are smoothed over the nearest neighbours, which gives the finest waves more inertia and so allows
//! longer steps (`filter.rs`); elements still too stiff for the step are softened when the garment is made, and counted.

mod awake;
mod blocks;
mod border;
mod contact;
mod fabric;
mod filter;
mod forces;
mod lanes;
mod motion;
mod plan;
mod stability;
mod struts;

pub use border::Borders;
pub use contact::{Plane, Tie};
pub use fabric::Fabric;
pub use forces::Step;
pub use motion::{Motion, V4};
pub use plan::{Fit, Plan, triangles};
pub use struts::{Excepted, Strut};

#[cfg(test)]
mod stress;
#[cfg(test)]
mod tests;
