//! Membrane energy of a flat triangle: co-rotated Hooke with the fabric's warp and weft.
//!
//! With the 3×2 deformation gradient F = [f_u f_v], its nearest isometry R and S = RᵀF:
//! W = μ‖F − R‖² + ½λ(tr S − 2)² + ½aᵤ(|f_u| − 1)² + ½aᵥ(|f_v| − 1)², per unit of rest area.
//! For small strain this is the St. Venant–Kirchhoff sheet with the same Lamé numbers (paper, section 4: Hooke's law in
//! the plane), and R costs a square root instead of an eigenvalue problem.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector3};
use std::ops::AddAssign as _;

/// Membrane stiffness (N/m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Membrane {
    /// 2D Lamé μ.
    pub mu: f64,
    /// 2D Lamé λ.
    pub lambda: f64,
    /// Extra Hooke stiffness along u (weft) and v (warp).
    pub along: [f64; 2],
}

/// Stretch ratio of a collapsed triangle: below it directions are arbitrary but finite.
const COLLAPSED: f64 = 1e-9;
/// Component of a unit vector above which another axis is a safer basis for its complement.
const ALIGNED: f64 = 0.9;

impl Membrane {
    /// Stiffness of a fabric: `along` is what μ and λ lack of the measured warp and weft stiffness.
    pub fn new(m: &tryon_garment::Material) -> Self {
        let nu = m.poisson();
        let plane = |k: f64| (k / (1.0 - nu * nu) - 2.0 * m.shear - m.coupling).max(0.0);
        Self {
            mu: m.shear,
            lambda: m.coupling,
            along: [plane(m.stretch_weft), plane(m.stretch_warp)],
        }
    }
    /// Largest curvature along u and v near rest: the weights of the constant matrix (N/m).
    pub fn stiffest(&self) -> [f64; 2] {
        [0, 1].map(|d| 2.0 * self.mu + self.lambda + self.along[d])
    }
    /// Hooke's law for small strain: stress (xx, yy, xy) of strain (xx, yy, xy) (N/m).
    pub fn hooke(&self) -> Matrix3<f64> {
        let [u, v] = self.stiffest();
        let (c, s) = (self.lambda, 4.0 * self.mu);
        Matrix3::new(u, c, 0.0, c, v, 0.0, 0.0, 0.0, s)
    }
    /// Energy per rest area (N/m).
    pub fn value(&self, f: &Matrix3x2<f64>) -> f64 {
        let (r, s) = polar(f);
        let axis = |d: usize| self.along[d] * (f.column(d).norm() - 1.0).powi(2);
        self.mu * (f - r).norm_squared()
            + 0.5 * (self.lambda * (s.trace() - 2.0).powi(2) + axis(0) + axis(1))
    }
    /// Derivative of the value by F (N/m).
    pub fn gradient(&self, f: &Matrix3x2<f64>) -> Matrix3x2<f64> {
        let (r, s) = polar(f);
        let mut g = (f - r) * (2.0 * self.mu) + r * (self.lambda * (s.trace() - 2.0));
        for d in 0..2 {
            if self.along[d] > 0.0 {
                let n = f.column(d).norm().max(COLLAPSED);
                let pull = f.column(d) * (self.along[d] * (1.0 - 1.0 / n));
                g.column_mut(d).add_assign(&pull);
            }
        }
        g
    }
}

/// F = R S with RᵀR = 1 and S symmetric positive; an arbitrary isometry for a collapsed F.
fn polar(f: &Matrix3x2<f64>) -> (Matrix3x2<f64>, Matrix2<f64>) {
    let c = f.transpose() * f;
    let s = c.determinant().max(0.0).sqrt();
    if s < COLLAPSED {
        let r = some_isometry(f);
        return (r, r.transpose() * f);
    }
    let t = (c.trace() + 2.0 * s).sqrt();
    let root = (c + Matrix2::identity() * s) / t;
    let inverse = Matrix2::new(root[(1, 1)], -root[(0, 1)], -root[(1, 0)], root[(0, 0)]) / s;
    (f * inverse, root)
}

/// Isometry along the first column of a collapsed F.
fn some_isometry(f: &Matrix3x2<f64>) -> Matrix3x2<f64> {
    let u: Vector3<f64> = f.column(0).into();
    let u = u.try_normalize(COLLAPSED).unwrap_or_else(Vector3::x);
    let v: Vector3<f64> = f.column(1).into();
    let v = (v - u * u.dot(&v))
        .try_normalize(COLLAPSED)
        .unwrap_or_else(|| {
            let other = if u.y.abs() < ALIGNED {
                Vector3::y()
            } else {
                Vector3::z()
            };
            (other - u * u.dot(&other)).normalize()
        });
    Matrix3x2::from_columns(&[u, v])
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};

    fn derivatives(along: [f64; 2]) -> impl Fn(&[f64], f64) -> Derivatives {
        move |x, weight| {
            let m = Membrane {
                mu: 400.0 * weight,
                lambda: 266.0 * weight,
                along: along.map(|a| a * weight),
            };
            let f = Matrix3x2::from_column_slice(x);
            Derivatives::energy(m.value(&f), m.gradient(&f).as_slice().to_vec())
        }
    }

    #[test]
    fn gradient_is_the_derivative_of_the_energy() {
        let points = [
            [1.0, 0.0, 0.05, 0.1, 1.05, -0.02],
            [0.3, 0.9, 0.4, -1.2, 0.4, 0.1],
            [0.7, 0.0, 0.1, 0.0, 0.8, 0.0], // compressed
            [1.3, -0.2, 0.1, 0.3, 0.9, 0.6],
            [1.0, 0.0, 0.0, 0.0, 1.0, 0.0],  // at rest
            [1.0, 0.0, 0.0, 0.0, 1e-3, 0.0], // nearly collapsed
        ]
        .map(|p| p.to_vec());
        // Forces near rest are small against the stiffness of 400 N/m.
        let check = DerivativeCheck {
            floor: 1e-3,
            ..DerivativeCheck::default()
        };
        for along in [[0.0; 2], [120.0, 900.0]] {
            check.run(&points, derivatives(along));
        }
        let collapsed = [
            vec![0.0; 6],
            vec![1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
            vec![0.0, 1.0, 0.0, 0.0, -2.0, 0.0],
        ];
        check.run_degenerate(&collapsed, derivatives([120.0, 900.0]));
    }

    #[test]
    fn uniform_stretch_has_its_closed_form_and_rotation_costs_nothing() {
        let m = Membrane {
            mu: 400.0,
            lambda: 266.0,
            along: [0.0; 2],
        };
        let f = Matrix3x2::new(1.02, 0.0, 0.0, 0.99, 0.0, 0.0);
        let expected = 400.0 * (0.02f64.powi(2) + 0.01f64.powi(2)) + 133.0 * 0.01f64.powi(2);
        assert!((m.value(&f) - expected).abs() < 1e-12);
        let turned = nalgebra::Rotation3::from_euler_angles(0.4, 1.2, -2.0) * f;
        assert!((m.value(&turned) - expected).abs() < 1e-10);
    }
}
