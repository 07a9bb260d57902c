//! Function of a squared distance as an energy of the stencil, its Hessian made positive semi-definite.
//!
//! With w, c and slides (T, e) of a [`Separation`] and b(D): ∇²E = 4 b″ (c⊗w)(c⊗w)ᵀ + b′ ∇²D. Along ŵ it is d²b/dd², in
//! the directions c⊗B across w and the slides 2 b′, and c⊗T couples with e⊗ŵ. So at most five directions have
//! curvature of either sign where b falls (b′ < 0), and what is outside of them is negative.

use crate::contact::distance::Separation;
use crate::math::{ElementEnergy, V3d, project_psd};
use nalgebra::{Matrix5, SMatrix, Vector4};

/// Second derivative that a potential returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Curvature {
    /// Nearest positive semi-definite matrix.
    #[default]
    Projected,
    /// Along the separation only: Gauss–Newton, of rank 1.
    GaussNewton,
    /// Second derivative as it is, indefinite.
    Exact,
}

/// Energy as a function of the squared distance D, with its derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct BarrierSample {
    /// b (J).
    pub value: f64,
    /// b′ = db/dD (J/m²).
    pub first: f64,
    /// b″ = d²b/dD² (J/m⁴).
    pub second: f64,
}

impl BarrierSample {
    /// The same of a pair of another weight.
    pub(super) fn scaled(self, weight: f64) -> Self {
        Self {
            value: self.value * weight,
            first: self.first * weight,
            second: self.second * weight,
        }
    }
}

/// Energy b(D) of a separation.
pub(super) fn compose(
    separation: &Separation<4>,
    b: &BarrierSample,
    curvature: Curvature,
) -> ElementEnergy<12> {
    let gradient = separation.gradient::<12>() * b.first;
    let hessian = match curvature {
        Curvature::Exact => {
            let d = separation.expansion::<12>();
            d.hessian * b.first + d.gradient * d.gradient.transpose() * b.second
        }
        Curvature::GaussNewton => {
            let along = 2.0 * b.first / separation.squared + 4.0 * b.second;
            let g = Separation::stack::<12>(&separation.weights, &separation.vector);
            g * g.transpose() * along.max(0.0)
        }
        Curvature::Projected => projected(separation, b),
    };
    ElementEnergy {
        value: b.value,
        gradient,
        hessian,
    }
}

/// Nearest positive semi-definite matrix to ∇²b(D), in an orthonormal basis of the (at most) five directions.
fn projected(separation: &Separation<4>, b: &BarrierSample) -> SMatrix<f64, 12, 12> {
    let distance = separation.squared.sqrt();
    let normal = separation.vector / distance;
    let slides = separation.slides();

    // Gram–Schmidt of c, e₁, e₂: columns of `triangle` are their coordinates in the axes.
    let mut axes = [Vector4::zeros(); 3];
    let mut triangle = SMatrix::<f64, 3, 3>::zeros();
    let columns = std::iter::once(separation.weights).chain(slides.iter().map(|s| s.rate));
    for (k, column) in columns.enumerate() {
        let mut rest = column;
        for j in 0..k {
            triangle[(j, k)] = axes[j].dot(&column);
            rest -= axes[j] * triangle[(j, k)];
        }
        triangle[(k, k)] = rest.norm();
        if triangle[(k, k)] > f64::MIN_POSITIVE {
            axes[k] = rest / triangle[(k, k)];
        }
    }

    let mut small = Matrix5::zeros();
    let across = -2.0 * b.first;
    let diagonal = [
        4.0 * b.second * separation.squared - across,
        across * separation.squared,
        across * separation.squared,
    ];
    for (i, j, k) in (0..27).map(|n| (n / 9, n / 3 % 3, n % 3)) {
        small[(i, j)] += diagonal[k] * triangle[(i, k)] * triangle[(j, k)];
    }
    for k in 0..slides.len() {
        for i in 0..3 {
            let coupling = across * distance * triangle[(i, k + 1)] * triangle[(0, 0)];
            small[(i, 3 + k)] = coupling;
            small[(3 + k, i)] = coupling;
        }
    }

    let stack = |c: &Vector4<f64>, a: &V3d| Separation::stack::<12>(c, a);
    let tangent = |k: usize| slides.get(k).map_or_else(V3d::zeros, |s| s.tangent);
    let basis = SMatrix::<f64, 12, 5>::from_columns(&[
        stack(&axes[0], &normal),
        stack(&axes[1], &normal),
        stack(&axes[2], &normal),
        stack(&axes[0], &tangent(0)),
        stack(&axes[0], &tangent(1)),
    ]);
    basis * (project_psd(&small) * basis.transpose())
}
