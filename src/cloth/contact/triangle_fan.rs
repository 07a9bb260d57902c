//! Closest points of eight triangles to one query at once (Ericson, Real-Time Collision Detection, 5.1.5).

use tryon_geometry::math::P3;

/// Triangles of a fan: the lanes of a wide register.
pub(crate) const LANES: usize = 8;

/// Triangles a b c and a query p: coordinates of b − a, c − a and p − a, metres; shape `[axis][lane]`.
#[derive(Default)]
pub(crate) struct TriangleFan {
    pub(super) ab: [[f32; LANES]; 3],
    pub(super) ac: [[f32; LANES]; 3],
    pub(super) ap: [[f32; LANES]; 3],
}

impl TriangleFan {
    /// The first [`LANES`] of some triangles, and a query.
    pub(crate) fn new(p: &P3, triangles: impl Iterator<Item = [P3; 3]>) -> Self {
        let mut fan = Self::default();
        for (l, [a, b, c]) in triangles.take(LANES).enumerate() {
            for d in 0..3 {
                (fan.ab[d][l], fan.ac[d][l], fan.ap[d][l]) =
                    (b[d] - a[d], c[d] - a[d], p[d] - a[d]);
            }
        }
        fan
    }
    /// Barycentric weights of b and c at the closest points, and squared distances (m²).
    ///
    /// All Voronoi regions are computed and one is selected, so that the lanes do not branch.
    pub(crate) fn closest(&self) -> ([[f32; LANES]; 2], [f32; LANES]) {
        let (mut weights, mut square) = ([[0.0; LANES]; 2], [0.0; LANES]);
        for l in 0..LANES {
            let (ab, ac, ap) = (
                self.ab.each_ref().map(|a| a[l]),
                self.ac.each_ref().map(|a| a[l]),
                self.ap.each_ref().map(|a| a[l]),
            );
            let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let (d1, d2, mixed) = (dot(ab, ap), dot(ac, ap), dot(ab, ac));
            let (d3, d4, d5, d6) = (d1 - dot(ab, ab), d2 - mixed, d1 - mixed, d2 - dot(ac, ac));
            let (vc, vb, va) = (d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4);
            let share = |a: f32, of: f32| if of == 0.0 { 0.0 } else { a / of };
            let sum = va + vb + vc;
            let mut at = [share(vb, sum), share(vc, sum)];
            // Later regions take precedence.
            let mut select = |inside: bool, a: [f32; 2]| at = if inside { a } else { at };
            let t = share(d4 - d3, (d4 - d3) + (d5 - d6));
            select((va <= 0.0) & (d4 >= d3) & (d5 >= d6), [1.0 - t, t]);
            select(
                (vb <= 0.0) & (d2 >= 0.0) & (d6 <= 0.0),
                [0.0, share(d2, d2 - d6)],
            );
            select((d6 >= 0.0) & (d5 <= d6), [0.0, 1.0]);
            select(
                (vc <= 0.0) & (d1 >= 0.0) & (d3 <= 0.0),
                [share(d1, d1 - d3), 0.0],
            );
            select((d3 >= 0.0) & (d4 <= d3), [1.0, 0.0]);
            select((d1 <= 0.0) & (d2 <= 0.0), [0.0, 0.0]);
            let r: [f32; 3] = std::array::from_fn(|d| ap[d] - ab[d] * at[0] - ac[d] * at[1]);
            (weights[0][l], weights[1][l], square[l]) = (at[0], at[1], dot(r, r));
        }
        (weights, square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use tryon_geometry::spatial::closest_on_triangle;

    #[test]
    fn closest_agrees_with_the_scalar_triangle_also_without_area() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(7);
        let mut random = || rng.random_range(-0.5f32..0.5);
        for round in 0..400 {
            let mut fan = TriangleFan::default();
            for axis in 0..3 {
                fan.ab[axis] = std::array::from_fn(|_| random());
                // Every fourth round without area, every fourth round a point.
                let thin = [random(), 0.5, 0.0, random()][round % 4];
                let flat = round % 4 == 1 || round % 4 == 2;
                fan.ac[axis] = fan.ab[axis].map(|a| if flat { thin * a } else { random() });
                fan.ap[axis] = std::array::from_fn(|_| 2.0 * random());
            }
            let (weights, square) = fan.closest();
            for l in 0..LANES {
                let of = |a: &[[f32; LANES]; 3]| P3::new(a[0][l], a[1][l], a[2][l]);
                let (b, c, p) = (of(&fan.ab), of(&fan.ac), of(&fan.ap));
                let w = closest_on_triangle(&p, [P3::origin(), b, c]);
                let alone = (p.coords - b.coords * w[1] - c.coords * w[2]).norm_squared();
                assert!((square[l] - alone).abs() < 1e-4, "{round} {l}: {alone}");
                let (v, w) = (weights[0][l], weights[1][l]);
                assert!(v >= -1e-3 && w >= -1e-3 && v + w <= 1.001, "{round} {l}");
            }
        }
    }
}
