//! Landmarks of the rest pose and smooth steps between them.

use tryon_body::{RestBody, Template};
use tryon_geometry::math::V3;

/// Position of a joint in the rest pose, metres; the origin if there is none of that name.
pub(super) fn rest_joint(template: &Template, rest: &RestBody, name: &str) -> V3 {
    let at = template.skeleton().index(name);
    at.map_or(V3::zeros(), |j| rest.joints[j].coords.cast())
}

/// 0 below `low`, 1 above `high`, smooth between.
pub(super) fn ramp(x: f32, low: f32, high: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
