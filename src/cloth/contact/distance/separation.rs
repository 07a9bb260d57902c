//! Squared distance at the closest points of two simplices, with its derivatives by the envelope theorem.
//!
//! D(x) = min over t of |w|², w = Σ cₖ(t) xₖ. With A = ∂w/∂t (3×m) and Gₖ = cₖ A + w ∂cₖ/∂t:
//! ∇ₖD = 2 cₖ w and ∇²D = 2 (c cᵀ ⊗ I − G (AᵀA)⁻¹ Gᵀ). Gram–Schmidt on A turns the last term into m outer squares.

use nalgebra::{SVector, Vector4};
use tryon_geometry::math::{ElementEnergy, V3d};

/// Features that hold the closest points, as slots of the stencil.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClosestFeatures {
    /// Two vertices.
    VertexVertex(u8, u8),
    /// A vertex and the inside of an edge.
    VertexEdge(u8, [u8; 2]),
    /// The first vertex of the stencil and the inside of the triangle of the others.
    VertexFace,
    /// The insides of two edges, the first two and the last two vertices of the stencil.
    EdgeEdge,
}

impl ClosestFeatures {
    /// Directions in which the closest points slide along their features.
    pub fn slide_count(self) -> usize {
        match self {
            Self::VertexVertex(..) => 0,
            Self::VertexEdge(..) => 1,
            Self::VertexFace | Self::EdgeEdge => 2,
        }
    }
}

/// Direction in which the closest points slide, orthonormal to the other slide and to the separation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slide<const V: usize> {
    /// Unit direction of ∂w/∂τ.
    pub tangent: V3d,
    /// ∂c/∂τ, change of the weights per length of slide (1/m).
    pub rate: SVector<f64, V>,
}

impl Slide<4> {
    /// Gram–Schmidt on the directions `u`, `v` (n = u × v, not zero) in which the closest points move, with ∂c/∂t.
    #[inline]
    pub(super) fn span([u, v]: [&V3d; 2], n: &V3d, rates: [Vector4<f64>; 2]) -> [Self; 2] {
        let (length, area) = (u.norm(), n.norm());
        let first = Self {
            tangent: u / length,
            rate: rates[0] / length,
        };
        let height = area / length;
        let second = Self {
            tangent: n.cross(&first.tangent) / area,
            rate: (rates[1] - first.rate * v.dot(&first.tangent)) / height,
        };
        [first, second]
    }
}

/// Closest points of two simplices of together `V` vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Separation<const V: usize> {
    /// D, squared distance (m²).
    pub squared: f64,
    /// w = Σ cₖ xₖ, from the second simplex's closest point to the first's (m).
    pub vector: V3d,
    /// c: barycentric on the first simplex, negative barycentric on the second; the sum is zero.
    pub weights: SVector<f64, V>,
    /// Features that hold the closest points.
    pub features: ClosestFeatures,
    /// Slides; only the first [`ClosestFeatures::slide_count`] count.
    pub(super) slides: [Slide<V>; 2],
}

impl<const V: usize> Separation<V> {
    /// Separation without slides: that of two vertices.
    pub(super) fn new(vector: V3d, weights: SVector<f64, V>, features: ClosestFeatures) -> Self {
        let none = Slide {
            tangent: V3d::zeros(),
            rate: SVector::zeros(),
        };
        Self {
            squared: vector.norm_squared(),
            vector,
            weights,
            features,
            slides: [none; 2],
        }
    }
    /// Directions in which the closest points slide: none for two vertices, one on an edge, two on faces and edge pairs.
    pub fn slides(&self) -> &[Slide<V>] {
        &self.slides[..self.features.slide_count()]
    }
    /// The same from the second simplex: w, c and the slides change sign, the derivatives of D do not.
    #[inline]
    pub(super) fn negated(mut self) -> Self {
        self.vector = -self.vector;
        self.weights = -self.weights;
        for slide in &mut self.slides {
            slide.rate = -slide.rate;
            slide.tangent = -slide.tangent;
        }
        self
    }
    /// The same in a larger stencil, vertex `k` in slot `slots[k]`; the other vertices have no weight.
    #[inline]
    pub(in crate::contact) fn embed<const W: usize>(&self, slots: [u8; V]) -> Separation<W> {
        let spread = |from: &SVector<f64, V>| {
            let mut to = SVector::zeros();
            for k in 0..V {
                to[usize::from(slots[k])] = from[k];
            }
            to
        };
        let slot = |k: u8| slots[usize::from(k)];
        let features = match self.features {
            ClosestFeatures::VertexVertex(a, b) => ClosestFeatures::VertexVertex(slot(a), slot(b)),
            ClosestFeatures::VertexEdge(v, edge) => {
                ClosestFeatures::VertexEdge(slot(v), edge.map(slot))
            }
            whole => whole,
        };
        Separation {
            squared: self.squared,
            vector: self.vector,
            weights: spread(&self.weights),
            features,
            slides: self.slides.map(|s| Slide {
                tangent: s.tangent,
                rate: spread(&s.rate),
            }),
        }
    }
    /// c ⊗ a: vector of the stencil's `N` = 3 `V` unknowns.
    #[inline]
    pub(in crate::contact) fn stack<const N: usize>(
        c: &SVector<f64, V>,
        a: &V3d,
    ) -> SVector<f64, N> {
        const { assert!(N == 3 * V, "three unknowns a vertex") };
        SVector::from_fn(|i, _| c[i / 3] * a[i % 3])
    }
    /// ∇D (m), `N` = 3 `V`.
    #[inline]
    pub fn gradient<const N: usize>(&self) -> SVector<f64, N> {
        Self::stack(&self.weights, &(self.vector * 2.0))
    }
    /// D (m²), ∇D (m) and the indefinite ∇²D, `N` = 3 `V`. ∇²D jumps where the closest features change.
    pub fn expansion<const N: usize>(&self) -> ElementEnergy<N> {
        let mut energy = ElementEnergy::<N> {
            value: self.squared,
            gradient: self.gradient(),
            ..ElementEnergy::default()
        };
        for k in 0..V {
            for l in 0..V {
                let product = 2.0 * self.weights[k] * self.weights[l];
                for i in 0..3 {
                    energy.hessian[(3 * k + i, 3 * l + i)] = product;
                }
            }
        }
        for slide in self.slides() {
            let g: SVector<f64, N> =
                Self::stack(&self.weights, &slide.tangent) + Self::stack(&slide.rate, &self.vector);
            energy.hessian.ger(-2.0, &g, &g, 1.0);
        }
        energy
    }
}
