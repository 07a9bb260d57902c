//! Squared distance of a point and an edge.

use super::point_point::point_point;
use super::separation::{ClosestFeatures, Separation, Slide};
use nalgebra::Vector3;
use tryon_geometry::math::V3d;

/// Separation of `p` from the segment `a b` (m); stencil p, a, b. An edge without length is its first end.
#[inline]
pub fn point_edge(p: &V3d, a: &V3d, b: &V3d) -> Separation<3> {
    let u = b - a;
    let squared_length = u.norm_squared();
    let along = (p - a).dot(&u);
    if !(along > 0.0 && squared_length > f64::MIN_POSITIVE) {
        return point_point(p, a).embed([0, 1]);
    }
    let before_end = (b - p).dot(&u);
    if !(before_end > 0.0) {
        return point_point(p, b).embed([0, 2]);
    }

    // From the nearer end, then once more along the edge: what rounding leaves is perpendicular.
    let [wa, wb] = [before_end, along].map(|v| v / (along + before_end));
    let vector = if wb < 0.5 {
        p - a - u * wb
    } else {
        p - b + u * wa
    };
    let vector = vector - u * (vector.dot(&u) / squared_length);

    let weights = Vector3::new(1.0, -wa, -wb);
    let features = ClosestFeatures::VertexEdge(0, [1, 2]);
    let mut separation = Separation::new(vector, weights, features);
    let length = squared_length.sqrt();
    separation.slides[0] = Slide {
        tangent: u / length,
        rate: Vector3::new(0.0, -1.0, 1.0) / length,
    };
    separation
}
