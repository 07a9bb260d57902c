//! Mollifier of nearly parallel edges (Li et al. 2020, IPC, eq. 24): the closest points of two edges jump where the
//! edges become parallel, so what acts on an edge pair fades out there.

use nalgebra::{Matrix3, SVector};
use tryon_geometry::math::{ElementEnergy, V3d};

/// Squared sine below which edges at their rest lengths are mollified (Li et al. 2020, section 5.2).
const SQUARED_SINE: f64 = 1e-3;

/// ε (m⁴): squared cross product of two edges below which they are mollified, from edges of rest.
pub fn mollifier_threshold(a: &V3d, b: &V3d) -> f64 {
    SQUARED_SINE * a.norm_squared() * b.norm_squared()
}

/// m(y) = y (2 − y) of y = |u × v|² / ε, for y < 1; 1 above. Twice differentiable but for its second derivative at 1.
#[derive(Clone, Copy, Debug)]
pub struct ParallelMollifier {
    u: V3d,
    v: V3d,
    /// u × v.
    n: V3d,
    threshold: f64,
}

impl ParallelMollifier {
    /// Mollifier of edges along `u` and `v` (m) with `threshold` ε (m⁴); `None` where it is 1.
    #[inline]
    pub fn new(u: V3d, v: V3d, threshold: f64) -> Option<Self> {
        let n = u.cross(&v);
        (n.norm_squared() < threshold).then_some(Self { u, v, n, threshold })
    }
    fn ratio(&self) -> f64 {
        self.n.norm_squared() / self.threshold
    }
    /// m, between 0 and 1.
    pub fn value(&self) -> f64 {
        let y = self.ratio();
        y * (2.0 - y)
    }
    /// m with its first and second derivative by ν = |u × v| (1/m², 1/m⁴).
    pub(in crate::contact) fn by_area(&self) -> [f64; 3] {
        let second = 4.0 / self.threshold * (1.0 - 3.0 * self.ratio());
        let first = self.slope_over_area() * self.n.norm();
        [self.value(), first, second]
    }
    /// m_ν / ν (1/m⁴), finite for parallel edges.
    pub(in crate::contact) fn slope_over_area(&self) -> f64 {
        4.0 / self.threshold * (1.0 - self.ratio())
    }
    /// u and v (m).
    pub(in crate::contact) fn edges(&self) -> [V3d; 2] {
        [self.u, self.v]
    }
    /// m, ∇m (1/m) and the indefinite ∇²m (1/m²) by a₀, a₁, b₀, b₁ with u = a₁ − a₀, v = b₁ − b₀.
    pub fn expansion(&self) -> ElementEnergy<12> {
        let (u, v, n) = (&self.u, &self.v, &self.n);
        let y = self.ratio();
        let first = 2.0 * (1.0 - y) / self.threshold;
        let second = -2.0 / (self.threshold * self.threshold);

        // c = |u × v|².
        let [gu, gv] = [v.cross(n) * 2.0, n.cross(u) * 2.0];
        let identity = Matrix3::identity();
        let uu = (identity * v.norm_squared() - v * v.transpose()) * 2.0;
        let vv = (identity * u.norm_squared() - u * u.transpose()) * 2.0;
        let uv = (u * v.transpose() * 2.0 - v * u.transpose() - identity * u.dot(v)) * 2.0;
        let of_edges = [[uu, uv], [uv.transpose(), vv]];

        let gradient = SVector::<f64, 12>::from_fn(|i, _| {
            let g = if i < 6 { gu } else { gv };
            SIGNS[i / 3 % 2] * g[i % 3]
        });
        let mut energy = ElementEnergy {
            value: self.value(),
            gradient: gradient * first,
            hessian: gradient * gradient.transpose() * second,
        };
        for k in 0..4 {
            for l in 0..4 {
                let block = of_edges[k / 2][l / 2] * (SIGNS[k % 2] * SIGNS[l % 2] * first);
                let mut to = energy.hessian.fixed_view_mut::<3, 3>(3 * k, 3 * l);
                to += block;
            }
        }
        energy
    }
}

/// Derivative of an edge by its first and its second end.
const SIGNS: [f64; 2] = [-1.0, 1.0];
