//! Bending by dihedral angles (Bridson et al. 2003; Grinspun et al. 2003, "Discrete shells").
//!
//! A hinge stands for the curvature κ = (θ − θ̄) l/A across its edge, l its length and A the area of both wings, and costs
//! A · W(κ n nᵀ) with n the edge's normal in the material. Bent along any direction, equilateral triangles then cost
//! ½ B κ² per area; the weight of θ² is ½ B l²/A. On other meshes bending and twist are coupled (decision 067).

use super::{BendLaw, Dihedral};
use nalgebra::{Vector2, Vector3};
use tryon_geometry::math::{ElementEnergy, V3d};

/// Hinge of two triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HingeElement {
    /// Rest angle (rad).
    pub rest_angle: f64,
    /// Edge length over the area of both wings at rest (1/m).
    pub curvature_per_angle: f64,
    /// Area of both wings at rest (m²).
    pub area: f64,
    /// Curvature (κᵤᵤ, κᵥᵥ, 2 κᵤᵥ) of a unit curvature across the edge.
    pub direction: Vector3<f64>,
}

/// Treatment of the second derivative of the angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AngleHessian {
    /// Left out: the Hessian is positive semi-definite (Gauss–Newton).
    GaussNewton,
    /// Kept: the exact Hessian, indefinite where a hinge is bent.
    Exact,
}

impl HingeElement {
    /// Hinge whose edge has these unit normals in the two wings' material frames. `length` is that of the edge (m), `area`
    /// that of both wings (m²).
    pub(super) fn new(normals: [Vector2<f64>; 2], length: f64, area: f64, rest_angle: f64) -> Self {
        let across = |n: &Vector2<f64>| Vector3::new(n.x * n.x, n.y * n.y, 2.0 * n.x * n.y);
        Self {
            rest_angle,
            curvature_per_angle: length / area,
            area,
            direction: (across(&normals[0]) + across(&normals[1])) * 0.5,
        }
    }
    /// Energy (J), moment (J/rad) and its slope (J/rad²) of an angle.
    fn of_angle(&self, law: &BendLaw, angle: f64) -> (f64, f64, f64) {
        let scale = self.curvature_per_angle;
        let d = &self.direction;
        let w = law.expand(&(d * ((angle - self.rest_angle) * scale)));
        (
            self.area * w.value,
            self.area * scale * w.gradient.dot(d),
            self.area * scale * scale * d.dot(&(w.hessian * d)),
        )
    }
    /// Energy (J) after a motion of the corners.
    pub(super) fn moved_value(&self, law: &BendLaw, motion: &[[V3d; 4]; 2]) -> f64 {
        self.of_angle(law, Dihedral::continued_angle(motion)).0
    }
    /// Energy (J).
    pub fn value(&self, law: &BendLaw, x: &[V3d; 4]) -> f64 {
        self.moved_value(law, &[*x, *x])
    }
    /// Energy with its derivatives by (edge start, edge end, left apex, right apex).
    pub fn expand(&self, law: &BendLaw, x: &[V3d; 4], second: AngleHessian) -> ElementEnergy<12> {
        self.moved_expansion(law, &[*x, *x], second)
    }
    /// The same after a motion of the corners.
    pub(super) fn moved_expansion(
        &self,
        law: &BendLaw,
        motion: &[[V3d; 4]; 2],
        second: AngleHessian,
    ) -> ElementEnergy<12> {
        let (theta, x) = (Dihedral::continued(motion), &motion[1]);
        let (value, moment, slope) = self.of_angle(law, theta.angle);
        let g = &theta.gradient;
        let mut hessian = g * g.transpose() * slope.max(0.0);
        if second == AngleHessian::Exact {
            hessian = g * g.transpose() * slope + Dihedral::hessian(x) * moment;
        }
        ElementEnergy {
            value,
            gradient: g * moment,
            hessian,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};

    #[test]
    fn derivatives_agree_with_differences_and_gauss_newton_is_semi_definite() {
        let hinge = HingeElement::new([Vector2::new(0.6, 0.8); 2], 1.0, 0.6, 0.3);
        let corners =
            |x: &[f64]| [0, 1, 2, 3].map(|k| V3d::from_column_slice(&x[3 * k..3 * k + 3]));
        let evaluate = |x: &[f64], weight: f64| {
            let law = BendLaw::isotropic(2.0 * weight, 0.2);
            let e = hinge.expand(&law, &corners(x), AngleHessian::Exact);
            let psd = hinge.expand(&law, &corners(x), AngleHessian::GaussNewton);
            let least = psd.hessian.symmetric_eigenvalues().min();
            assert!(least >= -1e-12 * psd.hessian.norm());
            Derivatives::energy(e.value, e.gradient.as_slice().to_vec())
                .with_hessian(DMatrix::from_column_slice(12, 12, e.hessian.as_slice()))
        };
        let folded = [0.0, 0.1, 0.0, 1.0, 0.0, 0.0, 0.4, 0.7, 0.2, 0.7, -0.1, 0.6];
        let flat = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.4, 0.7, 0.0, 0.6, -0.5, 0.0];
        DerivativeCheck::default().run(&[folded.to_vec(), flat.to_vec()], evaluate);
        DerivativeCheck::default().run_degenerate(&[vec![0.0; 12]], evaluate);
    }
}
