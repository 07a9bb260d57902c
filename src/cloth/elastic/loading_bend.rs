//! Bending of a sheet whose yarns rub: the loading curve of KES-FB2, M = B κ + HB.
//!
//! Its energy ½ κᵀ D κ + HB (√(|κ|² + κ₀²) − κ₀) is that of bending from the flat sheet, where friction opposes every
//! curvature. The curve is followed back when the sheet unbends: residual curvature is not modelled.

use super::Jet;
use super::jet::Smooth;
use nalgebra::{Matrix3, Vector3};

/// Elastic bending with a moment of friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadingBend {
    /// D (N·m).
    pub elastic: Matrix3<f64>,
    /// HB: half the width of the hysteresis loop, a moment per width (N).
    pub friction: f64,
    /// κ₀: curvature from which friction is full (1/m).
    pub onset: f64,
}

impl LoadingBend {
    /// Energy per rest area (N/m), moment (N) and tangent (N·m) of a curvature (κᵤᵤ, κᵥᵥ, 2 κᵤᵥ).
    pub fn expand(&self, curvature: &Vector3<f64>) -> Jet {
        let [u, v, g] = [0, 1, 2].map(|k| Jet::variable(k, curvature[k]));
        let square = u * u + v * v + g * g * 0.5 + Jet::constant(self.onset * self.onset);
        let friction = (square.sqrt() - Jet::constant(self.onset)) * self.friction;
        Jet::quadratic(&self.elastic, curvature) + friction
    }
    /// Stiffness of a flat sheet (N·m).
    pub fn at_rest(&self) -> Matrix3<f64> {
        let rubbing = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.5));
        self.elastic + rubbing * (self.friction / self.onset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};

    fn law() -> LoadingBend {
        LoadingBend {
            elastic: Matrix3::new(2.0, 0.1, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0, 0.6),
            friction: 30.0,
            onset: 5.0,
        }
    }

    #[test]
    fn moment_and_tangent_are_derivatives_of_the_energy() {
        let evaluate = |x: &[f64], weight: f64| {
            let w = law().expand(&Vector3::from_column_slice(x)) * weight;
            Derivatives::energy(w.value, w.gradient.as_slice().to_vec())
                .with_hessian(DMatrix::from_column_slice(3, 3, w.hessian.as_slice()))
        };
        let points = [vec![3.0, -1.0, 2.0], vec![40.0, 1.0, -20.0]];
        DerivativeCheck::default().run(&points, evaluate);
        DerivativeCheck::default().run_degenerate(&[vec![0.0; 3]], evaluate);
        let rest = law().expand(&Vector3::zeros());
        assert!(rest.value == 0.0 && (rest.hessian - law().at_rest()).norm() < 1e-12);
    }

    #[test]
    fn moment_is_the_line_of_kes() {
        for curvature in [50.0, 200.0] {
            let moment = law().expand(&Vector3::new(curvature, 0.0, 0.0)).gradient[0];
            assert!((moment / (2.0 * curvature + 30.0) - 1.0).abs() < 2e-3);
        }
    }
}
