//! Quadratic bending across an edge (Bergou et al. 2006): E = ½ w (|Σ cₖ xₖ| − rest)².
//!
//! Equilateral wings of area A in all, across the normal n and tangent t of their edge, have w |Σ cₖ xₖ|² = w A² (3 nᵀκn −
//! tᵀκt)²/9. Over the three directions of such a mesh a cylinder's curvature κ costs ½ w A κ² per area, so that w = B/A
//! has the rigidity B. The 3 B/A of a Laplacian at edge midpoints would be three times as stiff.

use tryon_garment::Bending;
use tryon_geometry::math::V3d;

/// Two triangles on an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hinge {
    /// Edge ends, then the two opposite corners.
    pub v: [u32; 4],
    /// Coefficients; they sum to zero.
    pub c: [f64; 4],
    /// Stiffness (N/m).
    pub w: f64,
    /// Length of Σ cₖ xₖ at rest (m); zero for a flat hinge.
    pub rest: f64,
}

/// Share of the difference of two rigidities in the cosine of a hinge's direction, see [`HingeSide::rigidity`].
const CONTRAST: f64 = 0.75;
/// Least rigidity of a hinge by that of the softer direction, where the contrast is larger than a mesh can have.
const SOFTEST: f64 = 0.25;
/// Smallest 1 − cos² of a corner, so that the cotangent of a sliver stays finite.
const SLIVER: f64 = 1e-12;

/// Cotangent of the angle at `p` between sides of these lengths; `across` is opposite it.
fn cotangent(side: f64, edge: f64, across: f64) -> f64 {
    let cos =
        (side * side + edge * edge - across * across) / (2.0 * side * edge).max(f64::MIN_POSITIVE);
    cos / (1.0 - cos * cos).max(SLIVER).sqrt()
}

/// Flat triangle on an edge a b, by the lengths of its sides (m).
#[derive(Clone, Copy, Debug)]
pub(super) struct Wing {
    pub(super) edge: f64,
    /// From a and from b to the apex.
    pub(super) to_apex: [f64; 2],
}

impl Wing {
    /// Cotangents of the angles at a and at b.
    fn cotangents(&self) -> [f64; 2] {
        let [a, b] = self.to_apex;
        [cotangent(a, self.edge, b), cotangent(b, self.edge, a)]
    }
}

/// Face beside an edge, in its material coordinates: x along the weft, y along the warp.
#[derive(Clone, Copy, Debug)]
pub(super) struct HingeSide {
    /// Edge (m).
    pub(super) edge: [f64; 2],
    /// Area (m²).
    pub(super) area: f64,
}

impl HingeSide {
    /// Rigidity (N·m) of the hinge: ½ (Bᵤ + Bᵥ) + ¾ (Bᵤ − Bᵥ) cos 2φ, φ from the weft to the edge's normal.
    ///
    /// A cylinder across the weft costs a hinge (1 + 2 cos 2φ)². Averaged over the directions of an isotropic mesh, a
    /// rigidity f₀ + f₂ cos 2φ is f₀ ± ⅔ f₂ along weft and warp: hence ¾ for ½.
    pub(super) fn rigidity(&self, bending: &Bending) -> f64 {
        let [x, y] = self.edge;
        let double = (y * y - x * x) / (x * x + y * y).max(f64::MIN_POSITIVE);
        let least = bending.weft.min(bending.warp) * SOFTEST;
        (bending.mean() + CONTRAST * (bending.weft - bending.warp) * double).max(least)
    }
}

impl Hinge {
    /// Coefficients of a hinge with these wings.
    pub(super) fn coefficients(wings: &[Wing; 2]) -> [f64; 4] {
        let ([c1, c2], [c3, c4]) = (wings[0].cotangents(), wings[1].cotangents());
        [c2 + c4, c1 + c3, -c1 - c2, -c3 - c4]
    }
    /// Σ cₖ xₖ (m).
    #[inline]
    pub(crate) fn bow(&self, x: impl Fn(u32) -> V3d) -> V3d {
        (0..4).fold(V3d::zeros(), |s, k| s + x(self.v[k]) * self.c[k])
    }
    /// Energy (J).
    pub fn energy(&self, x: &[V3d]) -> f64 {
        let q = self.bow(|v| x[v as usize]);
        0.5 * self.w * (q.norm() - self.rest).powi(2)
    }
    /// Adds the derivative of the energy by the positions to `out` (N).
    pub fn add_gradient(&self, x: &[V3d], out: &mut [V3d]) {
        let mut q = self.bow(|v| x[v as usize]);
        if self.rest > 0.0 {
            let n = q.norm().max(f64::MIN_POSITIVE);
            q *= 1.0 - self.rest / n;
        }
        for k in 0..4 {
            out[self.v[k] as usize] += q * (self.w * self.c[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};

    /// Unit edge with two wings of height 0.6; positions are the unknowns.
    fn hinge(rest: f64, w: f64) -> Hinge {
        let wing = Wing {
            edge: 1.0,
            to_apex: [0.5f64.hypot(0.6); 2],
        };
        Hinge {
            v: [0, 1, 2, 3],
            c: Hinge::coefficients(&[wing; 2]),
            w,
            rest,
        }
    }

    fn unfolded(angle: f64) -> Vec<f64> {
        let (s, c) = angle.sin_cos();
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.6, 0.0]];
        let mut x = corners.concat();
        x.extend([0.5, -0.6 * c, 0.6 * s]);
        x
    }

    fn derivatives(rest: f64) -> impl Fn(&[f64], f64) -> Derivatives {
        move |x, weight| {
            let x: Vec<V3d> = x.chunks(3).map(V3d::from_column_slice).collect();
            let (h, mut gradient) = (hinge(rest, 3.0 * weight), vec![V3d::zeros(); 4]);
            h.add_gradient(&x, &mut gradient);
            let gradient = gradient.iter().flat_map(|g| [g.x, g.y, g.z]).collect();
            Derivatives::energy(h.energy(&x), gradient)
        }
    }

    #[test]
    fn gradient_is_the_derivative_of_the_energy() {
        let points = [0.1, 1.0, 2.5].map(unfolded);
        let check = DerivativeCheck::default();
        check.run(&points, derivatives(0.0));
        check.run(&points, derivatives(0.8));
        check.run(&[unfolded(0.0)], derivatives(0.0));
        check.run_degenerate(&[unfolded(0.0), vec![0.0; 12]], derivatives(0.8));
    }

    #[test]
    fn flat_hinge_has_no_energy_and_folding_costs_by_its_angle() {
        let energy = |angle| derivatives(0.0)(&unfolded(angle), 1.0).value;
        assert!(energy(0.0) < 1e-30);
        // |Σ cₖ xₖ| = 2 |c| h sin(θ/2) with c of a corner and wings of height h.
        let c = hinge(0.0, 1.0).c[2];
        for angle in [0.3, 1.2, 3.0] {
            let bow = 2.0 * c * 0.6 * f64::sin(0.5 * angle);
            assert!((energy(angle) - 1.5 * bow * bow).abs() < 1e-12);
        }
    }
}
