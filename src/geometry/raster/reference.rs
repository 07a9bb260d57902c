//! Brute-force rasteriser: the oracle of the fast one.

use super::screen::{Corner, ONE, Projector};
use super::{View, VisibilityBuffer, clip};
use crate::math::P3;
use crate::mesh::Face;

/// Draws all faces, both sides, one by one. Points in the view's frame. Faces that cross the near plane are cut there.
/// A pixel is covered when its centre is inside or on the edge of the triangle (corners snapped to 1/256 pixel);
/// depth is interpolated perspective-correctly in f64. Of equal depths the lower face number stays.
/// Faces with a corner that is not finite or out of range are left out.
pub fn rasterise_reference(
    view: &View,
    vertices: &[P3],
    faces: &[Face],
    out: &mut VisibilityBuffer,
) {
    out.reset(view);
    let projector = Projector::new(view);
    for (id, f) in faces.iter().enumerate() {
        let [Some(a), Some(b), Some(c)] = f.map(|i| vertices.get(i as usize)) else {
            continue;
        };
        let corners = [*a, *b, *c];
        let snapped = corners.map(|p| projector.corner(&p));
        if snapped.iter().any(Corner::is_outside) {
            clip::clip(&projector, corners, |piece| {
                draw(&projector, piece, id as u32, out)
            });
        } else {
            draw(&projector, snapped, id as u32, out);
        }
    }
}

fn draw(projector: &Projector, corners: [Corner; 3], id: u32, out: &mut VisibilityBuffer) {
    let [a, b, c] = corners.map(|c| [f64::from(c.x), f64::from(c.y)].map(|v| v / f64::from(ONE)));
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if area == 0.0 {
        return;
    }
    let lo = |k: usize| a[k].min(b[k]).min(c[k]).ceil().max(0.0) as u32;
    let hi = |k: usize, side: u32| {
        (a[k].max(b[k]).max(c[k]).floor() + 1.0).clamp(0.0, f64::from(side)) as u32
    };
    for v in lo(1)..hi(1, out.height) {
        for u in lo(0)..hi(0, out.width) {
            let (x, y) = (f64::from(u), f64::from(v));
            let edge = |p: &[f64; 2], q: &[f64; 2]| {
                ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / area
            };
            let w = [edge(&b, &c), edge(&c, &a), edge(&a, &b)];
            if w.iter().any(|w| *w < 0.0) {
                continue;
            }
            let q: f64 = w
                .iter()
                .zip(&corners)
                .map(|(w, c)| w * f64::from(c.q))
                .sum();
            let z = projector.depth(q) as f32;
            let i = v as usize * out.width as usize + u as usize;
            if z < out.depth[i] {
                out.depth[i] = z;
                out.face[i] = id;
            }
        }
    }
}
