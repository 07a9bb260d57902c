//! Energies of contact pairs: barrier of the distance, smoothed Coulomb friction, assembled over all pairs.

mod assembly;
mod barrier;
mod composition;
mod friction;
mod mollified;
#[cfg(test)]
mod tests;

pub use assembly::{ContactAssembly, ContactElement};
pub use barrier::Barrier;
pub use composition::{BarrierSample, Curvature};
pub use friction::{Friction, FrictionPair};
