//! Elasticity of a thin sheet in f64: stretch and bend laws, membranes, dihedral angles, the cloth model with its masses, assembly.

pub(crate) mod assembly;
pub(crate) mod bend_law;
pub(crate) mod curvature_set;
pub(crate) mod curvature_weights;
pub(crate) mod dihedral;
mod edges;
mod element_set;
mod error;
mod fabric;
mod fan_expansion;
mod fans;
mod jet;
pub(crate) mod loading_bend;
pub(crate) mod measured_bend;
pub(crate) mod measured_stretch;
pub(crate) mod membrane;
pub(crate) mod model;
mod packed;
pub(crate) mod rest_sheet;
pub(crate) mod stretch_law;
mod stretching;
pub(crate) mod tension_law;
#[cfg(test)]
mod tests;

pub use assembly::ElasticExpansion;
pub use bend_law::BendLaw;
pub use dihedral::{Dihedral, SheetMotion};
pub use error::ElasticError;
pub use fabric::ElasticFabric;
pub use jet::Jet;
pub use loading_bend::LoadingBend;
pub use measured_bend::MeasuredBend;
pub use measured_stretch::MeasuredStretch;
pub use membrane::MembraneElement;
pub use model::ClothModel;
pub use rest_sheet::{RestSheet, RestTriangle};
pub use stretch_law::StretchLaw;
pub use stretching::Stretching;
pub use tension_law::TensionLaw;
