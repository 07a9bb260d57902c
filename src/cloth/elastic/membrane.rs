//! Constant-strain triangle with Green–Lagrange strain (Volino, Magnenat-Thalmann & Faure 2009, section 3.1).
//!
//! F = [U V] maps material to space; εᵤᵤ = ½(U·U − 1), εᵥᵥ = ½(V·V − 1), γ = U·V. The energy is area · W(ε), whose
//! Hessian by F is Jᵀ C J + S ⊗ I: the tangent C between strain derivatives, and the stress S on the shape functions
//! (the "whole Jacobian" of that paper). Both are projected at once in the plane of the triangle, where they are a 4×4
//! block, and normal to it, where S alone acts, a 2×2 block.

use super::{Jet, RestTriangle, StretchLaw};
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Matrix3x4, Matrix4, Vector3};
use tryon_geometry::math::{ElementEnergy, V3d, project_psd};

/// Membrane of one triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MembraneElement {
    /// Rest triangle.
    pub rest: RestTriangle,
}

/// Second derivative by F, four 3×3 blocks [uu, uv, vu, vv] (N/m).
type BlocksByF = [[Matrix3<f64>; 2]; 2];

impl MembraneElement {
    /// Deformation gradient [U V] of a triangle with these corners.
    fn deformation(&self, x: &[V3d; 3]) -> Matrix3x2<f64> {
        let b = &self.rest.shape;
        let along = |d: usize| x[0] * b[0][d] + x[1] * b[1][d] + x[2] * b[2][d];
        Matrix3x2::from_columns(&[along(0), along(1)])
    }
    /// Green–Lagrange strain (εᵤᵤ, εᵥᵥ, γ).
    pub fn strain(&self, x: &[V3d; 3]) -> Vector3<f64> {
        green_strain(&self.deformation(x))
    }
    /// Energy (J).
    pub fn value(&self, law: &StretchLaw, x: &[V3d; 3]) -> f64 {
        self.rest.area * law.value(&self.strain(x))
    }
    /// Energy with gradient and positive semi-definite Hessian.
    pub fn expand(&self, law: &StretchLaw, x: &[V3d; 3]) -> ElementEnergy<9> {
        let f = self.deformation(x);
        let w = law.expand(&green_strain(&f));
        self.assemble(&f, &w, &projected_blocks(&f, &w))
    }
    /// Energy by the corners, of derivatives by F.
    fn assemble(&self, f: &Matrix3x2<f64>, w: &Jet, h: &BlocksByF) -> ElementEnergy<9> {
        let (area, b) = (self.rest.area, &self.rest.shape);
        let force = f * stress(w) * area;
        let mut out = ElementEnergy::<9> {
            value: area * w.value,
            ..ElementEnergy::default()
        };
        for i in 0..3 {
            out.gradient
                .fixed_rows_mut::<3>(3 * i)
                .copy_from(&(force * b[i]));
            for j in 0..3 {
                let mut block = Matrix3::zeros();
                for (a, c) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    block += h[a][c] * (area * b[i][a] * b[j][c]);
                }
                out.hessian
                    .fixed_view_mut::<3, 3>(3 * i, 3 * j)
                    .copy_from(&block);
            }
        }
        out
    }
}

/// Green–Lagrange strain (εᵤᵤ, εᵥᵥ, γ) of a deformation gradient.
fn green_strain(f: &Matrix3x2<f64>) -> Vector3<f64> {
    let (u, v) = (f.column(0), f.column(1));
    Vector3::new(
        0.5 * (u.norm_squared() - 1.0),
        0.5 * (v.norm_squared() - 1.0),
        u.dot(&v),
    )
}

/// Second Piola–Kirchhoff stress (N/m).
fn stress(w: &Jet) -> Matrix2<f64> {
    let s = &w.gradient;
    Matrix2::new(s[0], s[2], s[2], s[1])
}

/// Nearest positive semi-definite matrix to Jᵀ C J + S ⊗ I.
fn projected_blocks(f: &Matrix3x2<f64>, w: &Jet) -> BlocksByF {
    let (plane, normal) = frame(f);
    let s = stress(w);
    let in_plane = project_psd_4(in_plane_blocks(&plane.tr_mul(f), w, &s));
    let across = project_psd(&s);
    let nn = normal * normal.transpose();
    let mut h = [[Matrix3::zeros(); 2]; 2];
    for a in 0..2 {
        for b in 0..2 {
            let block = in_plane.fixed_view::<2, 2>(2 * a, 2 * b);
            h[a][b] = plane * block * plane.transpose() + nn * across[(a, b)];
        }
    }
    h
}

/// Jᵀ C J + S ⊗ I for a deformation gradient in the plane, unknowns (U₁, U₂, V₁, V₂).
fn in_plane_blocks(f: &Matrix2<f64>, w: &Jet, s: &Matrix2<f64>) -> Matrix4<f64> {
    let (u, v) = (f.column(0), f.column(1));
    let j = Matrix3x4::new(
        u[0], u[1], 0.0, 0.0, //
        0.0, 0.0, v[0], v[1], //
        v[0], v[1], u[0], u[1],
    );
    let mut h = j.tr_mul(&w.hessian) * j;
    for a in 0..2 {
        for b in 0..2 {
            h[(2 * a, 2 * b)] += s[(a, b)];
            h[(2 * a + 1, 2 * b + 1)] += s[(a, b)];
        }
    }
    h
}

/// Nearest positive semi-definite matrix; one that has a Cholesky factor already is returned as it is.
fn project_psd_4(m: Matrix4<f64>) -> Matrix4<f64> {
    if m.cholesky().is_some() {
        return m;
    }
    project_psd(&m)
}

/// Orthonormal basis of a plane that holds U and V, and its normal. A collapsed F lies in many: any of them serves.
fn frame(f: &Matrix3x2<f64>) -> (Matrix3x2<f64>, V3d) {
    /// Length relative to the longer column below which a direction is arbitrary.
    const COLLAPSED: f64 = 1e-12;
    let (u, v): (V3d, V3d) = (f.column(0).into(), f.column(1).into());
    let (long, short) = if u.norm_squared() >= v.norm_squared() {
        (u, v)
    } else {
        (v, u)
    };
    let first = long.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(V3d::x);
    let rest = short - first * first.dot(&short);
    let second = rest
        .try_normalize(COLLAPSED * long.norm())
        .unwrap_or_else(|| any_normal(&first));
    // Rounding in a sliver leaves a component along the first: orthogonalise twice.
    let second = (second - first * first.dot(&second)).normalize();
    (
        Matrix3x2::from_columns(&[first, second]),
        first.cross(&second),
    )
}

/// A unit vector at a right angle to the unit vector `d`.
fn any_normal(d: &V3d) -> V3d {
    let axis = if d.x.abs() < 0.6 { V3d::x() } else { V3d::y() };
    (axis - d * d.dot(&axis)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elastic::Stretching;
    use nalgebra::{DMatrix, Rotation3, Vector2};
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};

    fn element() -> MembraneElement {
        let corners = [[0.1, 0.2], [1.0, 0.4], [0.3, 1.1]].map(Vector2::from);
        MembraneElement {
            rest: RestTriangle::new(corners).expect("area"),
        }
    }

    fn law(weight: f64) -> StretchLaw {
        StretchLaw::Linear(Stretching {
            weft: 700.0 * weight,
            coupling: 150.0 * weight,
            warp: 900.0 * weight,
            shear: 60.0 * weight,
        })
    }

    /// Jᵀ C J + S ⊗ I.
    fn exact_blocks(f: &Matrix3x2<f64>, w: &Jet) -> BlocksByF {
        let zero = Matrix3::zeros();
        // Derivative of the strain by U and by V: rows are the strains.
        let (u, v) = (f.column(0), f.column(1));
        let by_u = Matrix3::from_columns(&[u.into(), Vector3::zeros(), v.into()]);
        let by_v = Matrix3::from_columns(&[Vector3::zeros(), v.into(), u.into()]);
        let (s, by) = (stress(w), [by_u, by_v]);
        let mut h = [[zero; 2]; 2];
        for a in 0..2 {
            for b in 0..2 {
                h[a][b] = by[a] * w.hessian * by[b].transpose() + Matrix3::identity() * s[(a, b)];
            }
        }
        h
    }

    /// Energy with gradient and the Hessian as it is, indefinite under compression: the oracle of the projection.
    fn expand_exact(law: &StretchLaw, x: &[V3d; 3]) -> ElementEnergy<9> {
        let f = element().deformation(x);
        let w = law.expand(&green_strain(&f));
        element().assemble(&f, &w, &exact_blocks(&f, &w))
    }

    /// Corners of the element under a deformation gradient with these columns.
    fn deformed(u: [f64; 3], v: [f64; 3]) -> [V3d; 3] {
        element()
            .rest
            .corners
            .map(|p| V3d::from(u) * p.x + V3d::from(v) * p.y)
    }

    fn corners(x: &[f64]) -> [V3d; 3] {
        [0, 1, 2].map(|k| V3d::from_column_slice(&x[3 * k..3 * k + 3]))
    }

    fn flat(x: [V3d; 3]) -> Vec<f64> {
        x.iter().flat_map(|p| [p.x, p.y, p.z]).collect()
    }

    /// At rest, stretched, sheared, compressed, inverted in its plane, and nearly a line.
    fn states() -> [Vec<f64>; 6] {
        [
            deformed([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            deformed([1.2, 0.1, 0.3], [0.2, 1.3, -0.2]),
            deformed([1.0, 0.0, 0.0], [0.5, 0.8, 0.1]),
            deformed([0.6, 0.1, 0.0], [0.0, 0.7, 0.1]),
            deformed([-0.9, 0.0, 0.1], [0.1, 0.8, 0.0]),
            deformed([0.8, 0.0, 0.0], [0.9, 1e-4, 0.0]),
        ]
        .map(flat)
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let evaluate = |x: &[f64], weight: f64| {
            let e = expand_exact(&law(weight), &corners(x));
            Derivatives::energy(e.value, e.gradient.as_slice().to_vec())
                .with_hessian(DMatrix::from_column_slice(9, 9, e.hessian.as_slice()))
        };
        let check = DerivativeCheck {
            floor: 0.1,
            ..DerivativeCheck::default()
        };
        check.run(&states(), evaluate);
    }

    #[test]
    fn projection_keeps_what_is_positive_and_stays_finite() {
        let mut states = states().to_vec();
        states.push(vec![0.0; 9]);
        states.push(flat(deformed([1.0, 0.0, 0.0], [2.0, 0.0, 0.0])));
        states.push(flat(deformed([0.0; 3], [0.0, 1e-200, 0.0])));
        states.push(flat(deformed([50.0, 0.0, 0.0], [0.0, 1e-9, 0.0])));
        for x in states {
            let exact = expand_exact(&law(1.0), &corners(&x));
            let psd = element().expand(&law(1.0), &corners(&x));
            assert_eq!((psd.value, psd.gradient), (exact.value, exact.gradient));
            // Oracle: the 9×9 eigenvalues. Shape functions are not orthonormal, so only signs compare.
            let scale = exact.hessian.norm();
            assert!(psd.hessian.symmetric_eigenvalues().min() > -1e-9 * scale);
            if exact.hessian.symmetric_eigenvalues().min() > -1e-9 * scale {
                assert!((psd.hessian - exact.hessian).norm() < 1e-9 * scale);
            }
        }
    }

    #[test]
    fn rigid_motion_costs_nothing_and_stretch_has_its_closed_form() {
        let turn = Rotation3::from_euler_angles(0.4, 1.2, -2.0);
        let moved = |x: [V3d; 3]| x.map(|p| turn * p + V3d::new(3.0, -1.0, 0.5));
        let rigid = element().expand(
            &law(1.0),
            &moved(deformed([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])),
        );
        assert!(rigid.value < 1e-25 && rigid.gradient.norm() < 1e-11);
        let (s, t) = (1.1, 0.95);
        let x = moved(deformed([s, 0.0, 0.0], [0.0, t, 0.0]));
        let (a, b) = (0.5 * (s * s - 1.0), 0.5 * (t * t - 1.0));
        let expected = 350.0 * a * a + 150.0 * a * b + 450.0 * b * b;
        let value = element().value(&law(1.0), &x) / element().rest.area;
        assert!((value - expected).abs() < 1e-10);
    }
}
