//! Moduli of an orthotropic membrane (Volino et al. 2009, section 3).

use super::ElasticError;
use nalgebra::Matrix3;

/// Orthotropic membrane stiffness (N/m): σᵤᵤ = c₁₁ εᵤᵤ + c₁₂ εᵥᵥ, σᵥᵥ = c₁₂ εᵤᵤ + c₂₂ εᵥᵥ, σᵤᵥ = c₃₃ γ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretching {
    /// Along u (weft).
    pub weft: f64,
    /// Coupling of both directions.
    pub coupling: f64,
    /// Along v (warp).
    pub warp: f64,
    /// Shear modulus: stress by the shear angle γ = 2 εᵤᵥ.
    pub shear: f64,
}

impl Stretching {
    /// Isotropic sheet: Young's modulus times thickness (N/m) and Poisson ratio.
    pub fn isotropic(membrane: f64, poisson: f64) -> Self {
        let plane = membrane / (1.0 - poisson * poisson);
        Self {
            weft: plane,
            coupling: plane * poisson,
            warp: plane,
            shear: membrane / (2.0 * (1.0 + poisson)),
        }
    }
    /// Orthotropic sheet: stiffness of a strip cut along the weft and along the warp, free to contract (Young's modulus times
    /// thickness, N/m), the geometric mean of both Poisson ratios, and the shear modulus (N/m).
    pub fn orthotropic(strips: [f64; 2], poisson: f64, shear: f64) -> Self {
        let plane = 1.0 / (1.0 - poisson * poisson);
        Self {
            weft: strips[0] * plane,
            coupling: poisson * plane * (strips[0] * strips[1]).sqrt(),
            warp: strips[1] * plane,
            shear,
        }
    }
    /// Stiffness matrix in the order (uu, vv, γ).
    pub fn matrix(&self) -> Matrix3<f64> {
        let c = self.coupling;
        Matrix3::new(self.weft, c, 0.0, c, self.warp, 0.0, 0.0, 0.0, self.shear)
    }
    /// Checks that every strain costs energy.
    ///
    /// # Errors
    /// [`ElasticError::Fabric`] names the modulus.
    pub(super) fn check(&self) -> Result<(), ElasticError> {
        let positive = [
            ("weft stiffness", self.weft),
            ("warp stiffness", self.warp),
            ("shear stiffness", self.shear),
            (
                "determinant of the stretching stiffness",
                self.weft * self.warp - self.coupling * self.coupling,
            ),
        ];
        match positive.iter().find(|(_, v)| !(*v > 0.0 && v.is_finite())) {
            None => Ok(()),
            Some(&(field, value)) => Err(ElasticError::Fabric { field, value }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_have_the_stiffness_asked_for() {
        let s = Stretching::orthotropic([300.0, 800.0], 0.3, 50.0);
        let compliance = s.matrix().try_inverse().expect("positive");
        assert!((compliance[(0, 0)] - 1.0 / 300.0).abs() < 1e-12);
        assert!((compliance[(1, 1)] - 1.0 / 800.0).abs() < 1e-12);
        let same = Stretching::orthotropic([500.0; 2], 0.2, 500.0 / 2.4);
        let isotropic = Stretching::isotropic(500.0, 0.2);
        assert!((same.matrix() - isotropic.matrix()).norm() < 1e-9);
        assert!(
            Stretching::orthotropic([300.0, -1.0], 0.3, 50.0)
                .check()
                .is_err()
        );
        assert!(
            Stretching::orthotropic([300.0, 800.0], 1.1, 50.0)
                .check()
                .is_err()
        );
    }
}
