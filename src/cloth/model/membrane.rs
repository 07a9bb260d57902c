//! Stretch and shear of a flat triangle: co-rotated Hooke with the fabric's warp and weft.
//!
//! With the 3×2 deformation gradient F = [f_u f_v], its nearest isometry R and S = RᵀF:
//! W = μ‖F − R‖² + ½λ(tr S − 2)² + ½aᵤ(|f_u| − 1)² + ½aᵥ(|f_v| − 1)², per unit of rest area.
//! For small strain this is the St. Venant–Kirchhoff sheet with the same Lamé numbers (paper, section 4: Hooke's law in
//! the plane), and R costs a square root instead of an eigenvalue problem.

use nalgebra::{Matrix2, Matrix3x2, Vector3};

/// Membrane stiffness in N/m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Membrane {
    /// 2D Lamé μ.
    pub mu: f64,
    /// 2D Lamé λ.
    pub lambda: f64,
    /// Extra Hooke stiffness along u (weft) and v (warp).
    pub along: [f64; 2],
}

impl Membrane {
    /// From a fabric: `along` makes up what μ and λ lack of the measured warp and weft stiffness.
    pub fn new(m: &crate::garment::Material) -> Self {
        let nu = m.coupling / (m.coupling + 2.0 * m.shear); // 2D: λ = 2μν/(1−ν)
        let plane = |k: f64| (k / (1.0 - nu * nu) - 2.0 * m.shear - m.coupling).max(0.0);
        Self {
            mu: m.shear,
            lambda: m.coupling,
            along: [plane(m.stretch_weft), plane(m.stretch_warp)],
        }
    }
    /// Largest curvature along u and v near rest: the weights of the constant matrix.
    pub fn stiffest(&self) -> [f64; 2] {
        [0, 1].map(|d| 2.0 * self.mu + self.lambda + self.along[d])
    }
    /// Energy per rest area, N/m.
    pub fn value(&self, f: &Matrix3x2<f64>) -> f64 {
        let (r, s) = polar(f);
        let axis = |d: usize| self.along[d] * (f.column(d).norm() - 1.0).powi(2);
        self.mu * (f - r).norm_squared()
            + 0.5 * (self.lambda * (s.trace() - 2.0).powi(2) + axis(0) + axis(1))
    }
    /// Derivative of the value by F, N/m.
    pub fn gradient(&self, f: &Matrix3x2<f64>) -> Matrix3x2<f64> {
        let (r, s) = polar(f);
        let mut g = (f - r) * (2.0 * self.mu) + r * (self.lambda * (s.trace() - 2.0));
        for d in 0..2 {
            if self.along[d] > 0.0 {
                let n = f.column(d).norm().max(SHORTEST);
                let pull = f.column(d) * (self.along[d] * (1.0 - 1.0 / n));
                g.column_mut(d).add_assign(&pull);
            }
        }
        g
    }
    /// The second derivative applied to a direction `df`. With `convex`, directions of negative curvature
    /// (compressed fabric wants to buckle) count as flat, so that the operator is positive semidefinite.
    pub fn hessian_apply(
        &self,
        f: &Matrix3x2<f64>,
        df: &Matrix3x2<f64>,
        convex: bool,
    ) -> Matrix3x2<f64> {
        let (r, s) = polar(f);
        let trace = s.trace();
        // dR: a turn within the plane and a tilt out of it.
        let e = r.transpose() * df;
        let turn = (e[(1, 0)] - e[(0, 1)]) / trace.max(SHORTEST);
        let in_plane = Matrix3x2::from_columns(&[r.column(1) * turn, r.column(0) * -turn]);
        let n = r.column(0).cross(&r.column(1));
        let det = s.determinant().max(SHORTEST * SHORTEST);
        let inverse = Matrix2::new(s[(1, 1)], -s[(0, 1)], -s[(1, 0)], s[(0, 0)]) / det;
        let tilt = n * (n.transpose() * df * inverse);
        let d_trace = r.dot(df);
        let along_r = self.lambda * (trace - 2.0) - 2.0 * self.mu; // factor of dR
        let mut h = df * (2.0 * self.mu) + r * (self.lambda * d_trace);
        if convex {
            // 2μ·df + c·dR with c < 0: the turn has eigenvalue 2μ + 2c/tr S, the tilt 2μ + c/σ; keep what is positive.
            let t = (2.0 * self.mu + 2.0 * along_r / trace.max(SHORTEST)).max(0.0);
            h += in_plane * (0.5 * trace * (t - 2.0 * self.mu)); // in_plane is 2/tr S of df's share along the turn
            let out = n * (n.transpose() * df);
            let c = Matrix2::identity() * (2.0 * self.mu) + inverse * along_r;
            h += n * (n.transpose() * df * crate::math::project_psd_2(&c)) - out * (2.0 * self.mu);
        } else {
            h += (in_plane + tilt) * along_r;
        }
        for d in 0..2 {
            if self.along[d] > 0.0 {
                let v: Vector3<f64> = f.column(d).into();
                let len = v.norm().max(SHORTEST);
                let u = v / len;
                let dv: Vector3<f64> = df.column(d).into();
                let bend = 1.0 - 1.0 / len;
                let bend = if convex { bend.max(0.0) } else { bend };
                let along = u * u.dot(&dv);
                h.column_mut(d)
                    .add_assign(&((along + (dv - along) * bend) * self.along[d]));
            }
        }
        h
    }
}

use std::ops::AddAssign as _;

/// A stretch below this is a collapsed triangle (ratio).
const SHORTEST: f64 = 1e-9;

/// F = R S with RᵀR = 1 and S symmetric positive. A collapsed F gets some isometry.
pub fn polar(f: &Matrix3x2<f64>) -> (Matrix3x2<f64>, Matrix2<f64>) {
    let c = f.transpose() * f;
    let s = c.determinant().max(0.0).sqrt();
    if s < SHORTEST {
        let u: Vector3<f64> = f.column(0).into();
        let u = u.try_normalize(SHORTEST).unwrap_or_else(Vector3::x);
        let v: Vector3<f64> = f.column(1).into();
        let v = (v - u * u.dot(&v))
            .try_normalize(SHORTEST)
            .unwrap_or_else(|| {
                let other = if u.y.abs() < 0.9 {
                    Vector3::y()
                } else {
                    Vector3::z()
                };
                (other - u * u.dot(&other)).normalize()
            });
        let r = Matrix3x2::from_columns(&[u, v]);
        return (r, r.transpose() * f);
    }
    let t = (c.trace() + 2.0 * s).sqrt();
    let root = (c + Matrix2::identity() * s) / t;
    let inverse = Matrix2::new(root[(1, 1)], -root[(0, 1)], -root[(1, 0)], root[(0, 0)]) / s;
    (f * inverse, root)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cases() -> Vec<Matrix3x2<f64>> {
        vec![
            Matrix3x2::new(1.0, 0.1, 0.0, 1.05, 0.05, -0.02),
            Matrix3x2::new(0.3, -1.2, 0.9, 0.4, 0.4, 0.1),
            Matrix3x2::new(0.7, 0.0, 0.0, 0.8, 0.1, 0.0), // compressed
            Matrix3x2::new(1.3, 0.3, -0.2, 0.9, 0.1, 0.6),
        ]
    }

    #[test]
    fn value_gradient_and_hessian_agree_with_finite_differences() {
        let m = Membrane {
            mu: 400.0,
            lambda: 266.0,
            along: [120.0, 900.0],
        };
        let d = Matrix3x2::new(0.3, -0.4, 0.2, 0.5, -0.6, 0.1);
        let h = 1e-6;
        for f in cases() {
            let slope = (m.value(&(f + d * h)) - m.value(&(f - d * h))) / (2.0 * h);
            assert!(
                (slope - m.gradient(&f).dot(&d)).abs() < 1e-4 * (1.0 + slope.abs()),
                "{slope}"
            );
            let change = (m.gradient(&(f + d * h)) - m.gradient(&(f - d * h))) / (2.0 * h);
            let exact = m.hessian_apply(&f, &d, false);
            assert!(
                (change - exact).norm() < 1e-4 * (1.0 + change.norm()),
                "{change} {exact}"
            );
        }
    }

    #[test]
    fn the_convex_hessian_has_no_negative_curvature_and_equals_the_true_one_under_tension() {
        let m = Membrane {
            mu: 400.0,
            lambda: 266.0,
            along: [120.0, 900.0],
        };
        let mut seed = 1u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1u32 << 24) - 0.5
        };
        for f in cases() {
            for _ in 0..200 {
                let d = Matrix3x2::from_fn(|_, _| random());
                assert!(d.dot(&m.hessian_apply(&f, &d, true)) > -1e-9);
            }
        }
        let f = Matrix3x2::new(1.2, 0.0, 0.0, 1.1, 0.0, 0.0);
        let d = Matrix3x2::new(0.3, -0.4, 0.2, 0.5, -0.6, 0.1);
        assert!((m.hessian_apply(&f, &d, true) - m.hessian_apply(&f, &d, false)).norm() < 1e-9);
    }

    #[test]
    fn uniform_stretch_has_its_closed_form_and_turning_costs_nothing() {
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
        assert!(
            m.gradient(&Matrix3x2::zeros())
                .iter()
                .all(|c| c.is_finite()),
            "a collapsed triangle"
        );
    }
}
