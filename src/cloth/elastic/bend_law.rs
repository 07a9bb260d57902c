//! Bending laws: energy per rest area of a curvature.

use super::jet::Smooth;
use super::measured_bend::MeasuredBend;
use super::{ElasticError, Jet, LoadingBend};
use crate::settings::ElasticSettings;
use nalgebra::{Matrix3, Vector3};
use tryon_garment::Bending;

/// Energy density of bending by the curvature (κᵤᵤ, κᵥᵥ, 2 κᵤᵥ) (1/m).
#[derive(Clone, Debug, PartialEq)]
pub enum BendLaw {
    /// ½ κᵀ D κ with a symmetric positive D (N·m).
    Linear(Matrix3<f64>),
    /// Linear with friction of the yarns (KES-FB2).
    Loading(LoadingBend),
    /// Measured, with a stiffness that depends on direction and curvature.
    Measured(Box<MeasuredBend>),
}

impl BendLaw {
    /// Isotropic plate: rigidity B (N·m) and Poisson ratio.
    pub fn isotropic(rigidity: f64, poisson: f64) -> Self {
        Self::orthotropic(&Bending::uniform(rigidity), poisson)
    }
    /// Orthotropic plate: rigidity of strips curved along weft and warp, and the geometric mean of both Poisson ratios. Twist
    /// is what the rigidity along the bias leaves, or Huber's.
    pub fn orthotropic(bending: &Bending, poisson: f64) -> Self {
        let (u, v) = (bending.weft, bending.warp);
        let root = (u * v).sqrt();
        let c = root * poisson;
        let twist = match bending.bias {
            Some(bias) => (bias - 0.25 * (u + v) - 0.5 * c).max(0.0),
            None => 0.5 * root * (1.0 - poisson),
        };
        let elastic = Matrix3::new(u, c, 0.0, c, v, 0.0, 0.0, 0.0, twist);
        if bending.friction > 0.0 {
            return Self::Loading(LoadingBend {
                elastic,
                friction: bending.friction,
                onset: ElasticSettings::default().friction_onset,
            });
        }
        Self::Linear(elastic)
    }
    /// Energy per rest area (N/m), moment (N) and tangent (N·m).
    pub fn expand(&self, curvature: &Vector3<f64>) -> Jet {
        match self {
            Self::Linear(d) => Jet::quadratic(d, curvature),
            Self::Loading(l) => l.expand(curvature),
            Self::Measured(m) => m.expand(curvature),
        }
    }
    /// Stiffness of a flat sheet (N·m).
    pub fn at_rest(&self) -> Matrix3<f64> {
        match self {
            Self::Linear(d) => *d,
            Self::Loading(l) => l.at_rest(),
            Self::Measured(m) => m.at_rest(),
        }
    }
    /// Checks that no curvature yields energy.
    ///
    /// # Errors
    /// [`ElasticError::Fabric`] with the least eigenvalue.
    pub(super) fn check(&self) -> Result<(), ElasticError> {
        let d = self.at_rest();
        let value = d.symmetric_eigenvalues().min();
        if d.iter().all(|v| v.is_finite()) && value >= 0.0 {
            return Ok(());
        }
        Err(ElasticError::Fabric {
            field: "bending stiffness",
            value,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rigidity (N·m) of a cylinder about an axis across 45°.
    fn along_bias(law: &BendLaw) -> f64 {
        let curvature = Vector3::new(0.5, 0.5, 1.0);
        2.0 * law.expand(&curvature).value
    }

    #[test]
    fn bias_is_measured_or_hubers_and_equal_directions_are_a_plate() {
        let mut own = Bending {
            warp: 4e-6,
            weft: 1e-6,
            bias: None,
            friction: 0.0,
        };
        for poisson in [0.0, 0.3] {
            let law = BendLaw::orthotropic(&own, poisson);
            assert!((along_bias(&law) / own.along_bias() - 1.0).abs() < 1e-12);
        }
        own.bias = Some(2e-6);
        let law = BendLaw::orthotropic(&own, 0.0);
        assert!((along_bias(&law) / 2e-6 - 1.0).abs() < 1e-12);
        let plate = BendLaw::isotropic(3e-6, 0.3).at_rest();
        assert!((plate[(2, 2)] - 0.35 * 3e-6).abs() < 1e-18);
    }
}
