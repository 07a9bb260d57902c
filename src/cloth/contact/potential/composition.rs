//! Function of a squared distance as an energy of the stencil, its Hessian made positive semi-definite.
//!
//! With w, c and slides (T, e) of a [`Separation`] and b(D): ∇²E = 4 b″ (c⊗w)(c⊗w)ᵀ + b′ ∇²D. Along c⊗ŵ the curvature is
//! d²b/dd²; each slide couples c⊗T with e⊗ŵ; across w and the slides it is 2 b′ < 0. So a semi-definite bound has rank 3.

use crate::contact::distance::Separation;
use nalgebra::{SMatrix, SVector};
use tryon_geometry::math::ElementEnergy;

/// Second derivative that a potential returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Curvature {
    /// Sum of the semi-definite parts of its terms, which is not below the second derivative.
    #[default]
    Projected,
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
    /// d²b/dd² (N/m), curvature along the distance d = √D.
    pub(super) fn along(&self, squared: f64) -> f64 {
        4.0 * self.second * squared + 2.0 * self.first
    }
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
        Curvature::Projected => by_slides(separation, b),
    };
    ElementEnergy {
        value: b.value,
        gradient,
        hessian,
    }
}

/// Hessian as R Rᵀ, in the vectors that [`slide_roots`] names.
fn by_slides(separation: &Separation<4>, b: &BarrierSample) -> SMatrix<f64, 12, 12> {
    let [first, second] = slide_roots(separation, b);
    let along = b.along(separation.squared).max(0.0).sqrt();
    let normal = separation.vector * (along / separation.squared.sqrt());
    let distance = Separation::stack(&separation.weights, &normal);
    let roots = SMatrix::<f64, 12, 3>::from_columns(&[distance, first, second]);
    roots * roots.transpose()
}

/// Roots of the semi-definite parts of the slides' terms in ∇²b(D): the sum of their squares exceeds those terms.
///
/// In the unit vectors e⊗ŵ / |e| and c⊗T / |c|, which are orthogonal, a slide's term is [[β, γ], [γ, 0]] with one positive
/// eigenvalue.
pub(super) fn slide_roots(separation: &Separation<4>, b: &BarrierSample) -> [SVector<f64, 12>; 2] {
    let distance = separation.squared.sqrt();
    let normal = separation.vector / distance;
    let across = -2.0 * b.first;
    let weight = separation.weights.norm();
    let mut roots = [SVector::zeros(); 2];
    for (root, slide) in roots.iter_mut().zip(separation.slides()) {
        let rate = slide.rate.norm();
        let beta = across * separation.squared * rate * rate;
        let gamma = across * distance * rate * weight;
        let eigenvalue = 0.5 * (beta + (beta * beta + 4.0 * gamma * gamma).sqrt());
        let scale = (eigenvalue / (eigenvalue * eigenvalue + gamma * gamma)).sqrt();
        if scale.is_finite() {
            let [x, y] = [eigenvalue * scale / rate, gamma * scale / weight];
            *root = Separation::stack::<12>(&slide.rate, &(normal * x))
                + Separation::stack::<12>(&separation.weights, &(slide.tangent * y));
        }
    }
    roots
}
