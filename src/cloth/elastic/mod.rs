//! Elasticity of a thin sheet in f64: stretch and bend laws, membranes, hinges, dihedral angles, the cloth model with its masses, assembly.

mod assembly;
mod bend_law;
mod curvature_set;
mod curvature_weights;
mod dihedral;
mod edges;
mod element_set;
mod error;
mod fabric;
mod fan_expansion;
mod fans;
mod hinge;
mod jet;
mod measured_bend;
mod measured_stretch;
mod membrane;
mod model;
mod packed;
mod rest_sheet;
mod stretch_law;
#[cfg(test)]
mod test_cantilever;
#[cfg(test)]
mod test_curves;
#[cfg(test)]
mod test_picture_frame;
#[cfg(test)]
mod test_statics;
#[cfg(test)]
mod test_strips;

pub use assembly::ElasticExpansion;
pub use bend_law::BendLaw;
pub use dihedral::{Dihedral, SheetMotion};
pub use error::ElasticError;
pub use fabric::ElasticFabric;
pub use hinge::{AngleHessian, HingeElement};
pub use jet::Jet;
pub use measured_bend::MeasuredBend;
pub use measured_stretch::MeasuredStretch;
pub use membrane::MembraneElement;
pub use model::{BendingModel, ClothModel};
pub use rest_sheet::{RestSheet, RestTriangle};
pub use stretch_law::{StretchLaw, Stretching};
