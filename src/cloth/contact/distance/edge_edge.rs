//! Squared distance of two edges.

use super::PARALLEL_SINE;
use super::point_edge::point_edge;
use super::separation::{ClosestFeatures, Separation, Slide};
use nalgebra::Vector4;
use tryon_geometry::math::V3d;

/// Separation of the segment `a` from the segment `b` (m); stencil a₀, a₁, b₀, b₁. Of parallel edges an end is closest.
#[inline]
pub fn edge_edge(a: [&V3d; 2], b: [&V3d; 2]) -> Separation<4> {
    inside(a, b).unwrap_or_else(|| ends(a, b))
}

/// The nearest end of either edge and the other edge: where convex |w|² takes its minimum if not inside.
fn ends([a0, a1]: [&V3d; 2], [b0, b1]: [&V3d; 2]) -> Separation<4> {
    let near = [
        point_edge(a0, b0, b1),
        point_edge(a1, b0, b1),
        point_edge(b0, a0, a1),
        point_edge(b1, a0, a1),
    ];
    let mut nearest = 0;
    for k in 1..near.len() {
        if near[k].squared < near[nearest].squared {
            nearest = k;
        }
    }
    let slot = nearest as u8;
    if nearest < 2 {
        near[nearest].embed([slot, 2, 3])
    } else {
        // The separation points from b to a.
        near[nearest].negated().embed([slot, 0, 1])
    }
}

/// Separation where the common perpendicular of the lines meets both edges.
#[inline]
fn inside([a0, a1]: [&V3d; 2], [b0, b1]: [&V3d; 2]) -> Option<Separation<4>> {
    let (u, v, r) = (a1 - a0, b1 - b0, a0 - b0);
    let n = u.cross(&v);
    let (area, lengths) = (n.norm_squared(), u.norm_squared() * v.norm_squared());
    if !(area > PARALLEL_SINE * PARALLEL_SINE * lengths) {
        return None;
    }
    let s = -r.dot(&v.cross(&n)) / area;
    let t = -r.dot(&u.cross(&n)) / area;
    if !(s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0) {
        return None;
    }

    // As for a triangle: the error of the normal acts on the rest of r only.
    let vector = n * ((r + u * s - v * t).dot(&n) / area);
    let weights = Vector4::new(1.0 - s, s, t - 1.0, -t);
    let mut separation = Separation::new(vector, weights, ClosestFeatures::EdgeEdge);
    let rates = [
        Vector4::new(-1.0, 1.0, 0.0, 0.0),
        Vector4::new(0.0, 0.0, -1.0, 1.0),
    ];
    separation.slides = Slide::span([&u, &v], &n, rates);
    Some(separation)
}
