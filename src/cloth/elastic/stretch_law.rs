//! Membrane laws: energy per rest area of a Green–Lagrange strain (Volino et al. 2009, section 3).

use super::jet::Smooth;
use super::measured_stretch::MeasuredStretch;
use super::{ElasticError, Jet, Stretching, TensionLaw};
use nalgebra::Vector3;

/// Energy density of a membrane by its strain (εᵤᵤ, εᵥᵥ, γ = 2 εᵤᵥ).
#[derive(Clone, Debug, PartialEq)]
pub enum StretchLaw {
    /// St. Venant–Kirchhoff with orthotropic moduli.
    Linear(Stretching),
    /// Tension curves along warp and weft (KES-FB1).
    Tension(Box<TensionLaw>),
    /// Measured along five directions, nonlinear and anisotropic (Wang et al. 2011).
    Measured(Box<MeasuredStretch>),
}

impl StretchLaw {
    /// Energy per rest area (N/m), stress and tangent.
    pub fn expand(&self, strain: &Vector3<f64>) -> Jet {
        match self {
            Self::Linear(s) => Jet::quadratic(&s.matrix(), strain),
            Self::Tension(t) => t.expand(strain),
            Self::Measured(m) => m.expand(strain),
        }
    }
    /// Energy per rest area (N/m).
    pub fn value(&self, strain: &Vector3<f64>) -> f64 {
        match self {
            Self::Linear(s) => 0.5 * strain.dot(&(s.matrix() * strain)),
            Self::Tension(t) => t.value(strain),
            Self::Measured(m) => m.value(strain),
        }
    }
    /// Checks that every strain costs energy.
    ///
    /// # Errors
    /// [`ElasticError::Fabric`] names the modulus.
    pub(super) fn check(&self) -> Result<(), ElasticError> {
        match self {
            Self::Linear(s) => s.check(),
            Self::Tension(t) => t.at_rest.check(),
            // Positive by construction.
            Self::Measured(_) => Ok(()),
        }
    }
}
