//! Metric of a point residual and the robust kernel of its weight.

use nalgebra::{Matrix3, Vector3};

/// A quadratic form on residuals, `isotropic · I + directional · d dᵀ`.
///
/// Point-to-plane is `d` = normal; distance from a viewing ray (eq. 10 of the paper, in metres instead of pixels) is
/// `isotropic = 1, directional = −1, d` = ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metric {
    /// Weight in all directions.
    pub isotropic: f64,
    /// Extra weight along `direction`; not below `-isotropic`.
    pub directional: f64,
    /// Unit vector.
    pub direction: Vector3<f64>,
}

impl Metric {
    /// Squared length of a residual.
    pub fn squared(&self, r: &Vector3<f64>) -> f64 {
        self.isotropic * r.norm_squared() + self.directional * self.direction.dot(r).powi(2)
    }
    /// Half the gradient of [`Metric::squared`].
    pub fn apply(&self, r: &Vector3<f64>) -> Vector3<f64> {
        r * self.isotropic + self.direction * (self.directional * self.direction.dot(r))
    }
    /// The matrix of the form.
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::identity() * self.isotropic
            + self.direction * self.direction.transpose() * self.directional
    }
}

/// Geman–McClure: ρ(e²) = σ²e²/(σ² + e²). Near zero it is e²; far outliers cost σ² and pull no more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GemanMcClure {
    /// Residuals beyond this (metres) fade out.
    pub sigma: f64,
}

impl GemanMcClure {
    /// ρ at the squared residual `e2`.
    pub fn value(&self, e2: f64) -> f64 {
        let s2 = self.sigma * self.sigma;
        s2 * e2 / (s2 + e2)
    }
    /// dρ/d(e²): the weight of iteratively reweighted least squares, 1 at zero.
    pub fn weight(&self, e2: f64) -> f64 {
        let s2 = self.sigma * self.sigma;
        (s2 / (s2 + e2)).powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernel_weight_is_its_derivative() {
        let k = GemanMcClure { sigma: 0.03 };
        for e2 in [0.0, 1e-6, 9e-4, 0.01, 1.0] {
            let h = 1e-8;
            let fd = (k.value(e2 + h) - k.value((e2 - h).max(0.0))) / (h + h.min(e2));
            assert!((fd - k.weight(e2)).abs() < 1e-4, "e² = {e2}");
        }
        assert!(k.value(1e12) <= k.sigma * k.sigma && k.weight(0.0) == 1.0);
    }

    #[test]
    fn metric_gradient_and_matrix_agree() {
        let m = Metric {
            isotropic: 0.1,
            directional: 1.0,
            direction: Vector3::new(0.6, 0.0, 0.8),
        };
        let r = Vector3::new(0.02, -0.01, 0.03);
        assert!((m.matrix() * r - m.apply(&r)).norm() < 1e-15);
        assert!((r.dot(&m.apply(&r)) - m.squared(&r)).abs() < 1e-15);
    }
}
