//! Distance of a point from a segment.

use tryon_geometry::math::P3;

/// Distance of a point from the segment between two others; from one of them if they are the same.
pub(crate) fn distance_from_segment(p: &P3, [a, b]: &[P3; 2]) -> f32 {
    let along = b - a;
    let t = (p - a).dot(&along) / along.norm_squared().max(f32::MIN_POSITIVE);
    (a + along * t.clamp(0.0, 1.0) - p).norm()
}
