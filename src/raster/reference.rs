//! The slow, obvious rasteriser: the oracle of the fast one.

use super::{View, VisibilityBuffer};
use crate::math::P3;
use crate::mesh::Face;

/// Draws all faces, both sides, one by one. Points in the view's frame. Faces that cross the near plane are left out.
/// A pixel is covered when its centre is inside the triangle; depth is interpolated perspective-correctly.
pub fn rasterise_reference(view: &View, vertices: &[P3], faces: &[Face], out: &mut VisibilityBuffer) {
    out.reset(view);
    let perspective = matches!(view, View::Perspective { .. });
    for (id, f) in faces.iter().enumerate() {
        let [Some(a), Some(b), Some(c)] = f.map(|i| view.project(&vertices[i as usize])) else { continue };
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area == 0.0 || !area.is_finite() {
            continue;
        }
        let lo = |k: usize| a[k].min(b[k]).min(c[k]).ceil().max(0.0) as u32;
        let hi = |k: usize, side: u32| (a[k].max(b[k]).max(c[k]).floor() + 1.0).clamp(0.0, side as f32) as u32;
        for v in lo(1)..hi(1, out.height) {
            for u in lo(0)..hi(0, out.width) {
                let (x, y) = (u as f32, v as f32);
                let edge =
                    |p: &[f32; 3], q: &[f32; 3]| ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / area;
                let (wa, wb, wc) = (edge(&b, &c), edge(&c, &a), edge(&a, &b));
                if wa < 0.0 || wb < 0.0 || wc < 0.0 {
                    continue;
                }
                let z = if perspective {
                    1.0 / (wa / a[2] + wb / b[2] + wc / c[2])
                } else {
                    wa * a[2] + wb * b[2] + wc * c[2]
                };
                let i = v as usize * out.width as usize + u as usize;
                if z < out.depth[i] {
                    out.depth[i] = z;
                    out.face[i] = id as u32;
                }
            }
        }
    }
}
