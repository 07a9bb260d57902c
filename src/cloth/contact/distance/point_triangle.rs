//! Squared distance of a point and a triangle.

use super::PARALLEL_SINE;
use super::point_edge::point_edge;
use super::separation::{ClosestFeatures, Separation, Slide};
use nalgebra::Vector4;
use tryon_geometry::math::V3d;

/// Separation of `p` from the triangle `a b c` (m); stencil p, a, b, c. A triangle without height is its edges.
#[inline]
pub fn point_triangle(p: &V3d, [a, b, c]: [&V3d; 3]) -> Separation<4> {
    inside(p, [a, b, c]).unwrap_or_else(|| {
        let mut nearest = point_edge(p, a, b).embed([0, 1, 2]);
        for (edge, slots) in [([b, c], [0, 2, 3]), ([c, a], [0, 3, 1])] {
            let other = point_edge(p, edge[0], edge[1]);
            if other.squared < nearest.squared {
                nearest = other.embed(slots);
            }
        }
        nearest
    })
}

/// Separation where `p` projects into the triangle.
#[inline]
fn inside(p: &V3d, [a, b, c]: [&V3d; 3]) -> Option<Separation<4>> {
    let (u, v, r) = (b - a, c - a, p - a);
    let n = u.cross(&v);
    let (area, lengths) = (n.norm_squared(), u.norm_squared() * v.norm_squared());
    if !(area > PARALLEL_SINE * PARALLEL_SINE * lengths) {
        return None;
    }
    let s = r.cross(&v).dot(&n) / area;
    let t = u.cross(&r).dot(&n) / area;
    let rest = 1.0 - s - t;
    if !(s > 0.0 && t > 0.0 && rest > 0.0) {
        return None;
    }

    // Projecting what is left of r keeps the error of the normal out of a distance that is small beside the edges.
    let vector = n * ((r - u * s - v * t).dot(&n) / area);
    let weights = Vector4::new(1.0, -rest, -s, -t);
    let mut separation = Separation::new(vector, weights, ClosestFeatures::VertexFace);
    let rates = [
        Vector4::new(0.0, -1.0, 1.0, 0.0),
        Vector4::new(0.0, -1.0, 0.0, 1.0),
    ];
    separation.slides = Slide::span([&u, &v], &n, rates);
    Some(separation)
}
