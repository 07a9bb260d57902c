//! Nearest neighbour by looking at every point: the oracle, and the faster way for a few hundred points.

use crate::math::P3;

/// Index and squared distance of the point nearest to `query` within `radius`; the smaller index wins a tie.
pub fn nearest_brute_force(points: &[P3], query: &P3, radius: f32) -> Option<(usize, f32)> {
    let mut best = None;
    let mut bound = radius * radius;
    for (i, p) in points.iter().enumerate() {
        let d = (p - query).norm_squared();
        if d < bound {
            bound = d;
            best = Some((i, d));
        }
    }
    best
}
