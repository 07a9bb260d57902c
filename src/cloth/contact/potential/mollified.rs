//! Product of a function of the squared distance and the mollifier of parallel edges, as an energy of an edge pair.
//!
//! E(d, ν) = m(ν) b(d) of the distance d and the area ν = |u × v|. ∇²E is a 2×2 matrix in ∇d and ∇ν, plus m b_d ∇²d,
//! plus m_ν b ∇²ν. Out of the plane of the edges, along n̂, ∇²ν is [[|v|², −u·v], [−u·v, |u|²]] / ν ≥ 0; within it ν is a
//! determinant, whose second derivative has the eigenvalues ±1.

use super::composition::{BarrierSample, Curvature, compose, slide_roots};
use crate::contact::distance::{ParallelMollifier, Separation};
use nalgebra::{Matrix2, SMatrix, SVector, SymmetricEigen};
use std::f64::consts::FRAC_1_SQRT_2;
use tryon_geometry::math::{ElementEnergy, V3d};

type Stacked = SVector<f64, 12>;

/// Energy m b(D) of an edge pair.
pub(super) fn compose_mollified(
    separation: &Separation<4>,
    b: &BarrierSample,
    mollifier: &ParallelMollifier,
    curvature: Curvature,
) -> ElementEnergy<12> {
    match curvature {
        Curvature::Projected => by_terms(separation, b, mollifier),
        Curvature::Exact => product(separation, b, mollifier),
    }
}

/// Product rule.
fn product(
    separation: &Separation<4>,
    b: &BarrierSample,
    mollifier: &ParallelMollifier,
) -> ElementEnergy<12> {
    let b = compose(separation, b, Curvature::Exact);
    let m = mollifier.expansion();
    let mut hessian = b.hessian * m.value + m.hessian * b.value;
    hessian.ger(1.0, &m.gradient, &b.gradient, 1.0);
    hessian.ger(1.0, &b.gradient, &m.gradient, 1.0);
    ElementEnergy {
        value: b.value * m.value,
        gradient: b.gradient * m.value + m.gradient * b.value,
        hessian,
    }
}

/// The same with the semi-definite part of each term: R Rᵀ of eight vectors.
fn by_terms(
    separation: &Separation<4>,
    b: &BarrierSample,
    mollifier: &ParallelMollifier,
) -> ElementEnergy<12> {
    let distance = separation.squared.sqrt();
    let normal = separation.vector / distance;
    let edges = EdgeFrame::new(mollifier, &normal);
    let [m, m1, m2] = mollifier.by_area();

    let along = Separation::stack(&separation.weights, &normal);
    let area = edges.gradient_of_area();
    let force = 2.0 * b.first * distance;
    let mixed = m1 * force;
    let joint = Matrix2::new(m * b.along(separation.squared), mixed, mixed, m2 * b.value);
    let [j0, j1] = joint_roots(&along, &area, joint);
    let [o0, o1] = edges.roots_out_of_plane((mollifier.slope_over_area() * b.value).sqrt());
    let [i0, i1] = edges.roots_in_plane((m1 * b.value).sqrt());
    let [s0, s1] = slide_roots(separation, b).map(|r| r * m.sqrt());

    let roots = SMatrix::<f64, 12, 8>::from_columns(&[j0, j1, o0, o1, i0, i1, s0, s1]);
    ElementEnergy {
        value: m * b.value,
        gradient: along * (m * force) + area * (m1 * b.value),
        hessian: roots * roots.transpose(),
    }
}

/// Roots of the semi-definite part of [p q] M [p q]ᵀ.
fn joint_roots(p: &Stacked, q: &Stacked, m: Matrix2<f64>) -> [Stacked; 2] {
    let length = p.norm();
    let x = p / length;
    let shared = x.dot(q);
    let rest = q - x * shared;
    let height = rest.norm();
    let y = if height > 0.0 { rest / height } else { rest };
    let r = Matrix2::new(length, shared, 0.0, height);
    let e = SymmetricEigen::new(r * m * r.transpose());
    [0, 1].map(|k| {
        let v = e.eigenvectors.column(k) * e.eigenvalues[k].max(0.0).sqrt();
        x * v[0] + y * v[1]
    })
}

/// Two edges and the normal of the plane that they span.
struct EdgeFrame {
    u: V3d,
    v: V3d,
    normal: V3d,
}

impl EdgeFrame {
    /// Normal of the mollifier's edges; of parallel ones the part of `otherwise` across them.
    fn new(mollifier: &ParallelMollifier, otherwise: &V3d) -> Self {
        let [u, v] = mollifier.edges();
        let normal = u.cross(&v).try_normalize(0.0).unwrap_or_else(|| {
            let u = u.try_normalize(0.0).unwrap_or_else(V3d::zeros);
            let across = otherwise - u * u.dot(otherwise);
            across.try_normalize(0.0).unwrap_or_else(V3d::zeros)
        });
        Self { u, v, normal }
    }
    /// Derivative by the ends of a derivative by the edges.
    fn stack(of_u: &V3d, of_v: &V3d) -> Stacked {
        Stacked::from_fn(|i, _| {
            let a = if i < 6 { of_u } else { of_v };
            if i / 3 % 2 == 0 { -a[i % 3] } else { a[i % 3] }
        })
    }
    /// ∇ν.
    fn gradient_of_area(&self) -> Stacked {
        Self::stack(&self.v.cross(&self.normal), &self.normal.cross(&self.u))
    }
    /// Roots of ν ∇²ν out of the plane: the Cholesky factor of its 2×2 matrix.
    fn roots_out_of_plane(&self, factor: f64) -> [Stacked; 2] {
        let length = self.v.norm();
        if !(length > 0.0) {
            return [Stacked::zeros(); 2];
        }
        let n = self.normal * (factor / length);
        let area = self.u.cross(&self.v).norm();
        [
            Self::stack(&(n * (length * length)), &(n * -self.u.dot(&self.v))),
            Self::stack(&V3d::zeros(), &(n * area)),
        ]
    }
    /// Roots of the semi-definite part of ∇²ν within the plane: (a, n̂ × a) / √2 for two directions a.
    fn roots_in_plane(&self, factor: f64) -> [Stacked; 2] {
        let x = self.u.try_normalize(0.0).unwrap_or_else(V3d::zeros) * (factor * FRAC_1_SQRT_2);
        let y = self.normal.cross(&x);
        [Self::stack(&x, &y), Self::stack(&y, &-x)]
    }
}
