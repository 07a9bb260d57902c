//! Squared distance of two points.

use super::separation::{ClosestFeatures, Separation};
use nalgebra::Vector2;
use tryon_geometry::math::V3d;

/// Separation of `p` from `q` (m); stencil p, q.
#[inline]
pub fn point_point(p: &V3d, q: &V3d) -> Separation<2> {
    Separation::new(
        p - q,
        Vector2::new(1.0, -1.0),
        ClosestFeatures::VertexVertex(0, 1),
    )
}
