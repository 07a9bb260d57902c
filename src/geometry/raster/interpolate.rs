//! Barycentric coordinates of a pixel on its visible face.

use super::{View, VisibilityBuffer};
use crate::math::P3;
use crate::mesh::Face;

/// Weights of the corners at the point of the triangle's plane seen at column `u`, row `v`; they sum to one and are
/// clamped to the triangle. `None` for a face seen edge-on.
pub fn barycentrics(view: &View, corners: [P3; 3], u: f32, v: f32) -> Option<[f32; 3]> {
    let [a, b, c] = corners;
    let w = match *view {
        View::Perspective { camera, .. } => {
            let d = camera.unproject(u, v, 1.0).coords;
            [
                d.dot(&b.coords.cross(&c.coords)),
                d.dot(&c.coords.cross(&a.coords)),
                d.dot(&a.coords.cross(&b.coords)),
            ]
        }
        View::Orthographic {
            left,
            top,
            pixels_per_metre,
            ..
        } => {
            let (x, y) = (u / pixels_per_metre + left, v / pixels_per_metre + top);
            let edge = |p: &P3, q: &P3| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
            [edge(&b, &c), edge(&c, &a), edge(&a, &b)]
        }
    };
    let sum: f32 = w.iter().sum();
    let w = w.map(|w| (w / sum).max(0.0));
    let sum: f32 = w.iter().sum();
    (sum.is_finite() && sum > 0.0).then(|| w.map(|w| w / sum))
}

/// Face number and corner weights at pixel `[column, row]` of a buffer drawn with `view`; `None` in empty pixels.
pub fn interpolate(
    view: &View,
    vertices: &[P3],
    faces: &[Face],
    buffer: &VisibilityBuffer,
    [u, v]: [u32; 2],
) -> Option<(u32, [f32; 3])> {
    if u >= buffer.width || v >= buffer.height {
        return None;
    }
    let id = buffer.face[v as usize * buffer.width as usize + u as usize];
    let f = faces.get(id as usize)?;
    let corners = f.map(|i| vertices[i as usize]);
    barycentrics(view, corners, u as f32, v as f32).map(|w| (id, w))
}
