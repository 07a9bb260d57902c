//! Clipping of triangles with a corner behind the near plane or far outside the picture (Sutherland–Hodgman).

use super::screen::{Corner, GUARD, Projector};
use crate::math::P3;

/// A triangle cut by five planes has at most eight corners.
const MAX_CORNERS: usize = 8;

/// Homogeneous picture point: (x·w, y·w, w, z).
type Hom = [f64; 4];

/// Clips a triangle at the near plane and at the guard band; `draw` receives the pieces in its orientation.
/// A triangle with a corner that is not finite gives no piece.
pub(super) fn clip(view: &Projector, corners: [P3; 3], mut draw: impl FnMut([Corner; 3])) {
    if !corners.iter().all(|p| p.iter().all(|c| c.is_finite())) {
        return;
    }
    let mut polygon = [[0.0; 4]; MAX_CORNERS + 1];
    let mut n = 3;
    for (slot, p) in polygon.iter_mut().zip(&corners) {
        let w = if view.perspective {
            f64::from(p.z)
        } else {
            1.0
        };
        let axis =
            |k: usize| f64::from(p[k]) * f64::from(view.scale[k]) + f64::from(view.offset[k]) * w;
        *slot = [axis(0), axis(1), w, f64::from(p.z)];
    }
    // One pixel inside the band, so that rounding to f32 and snapping cannot leave it.
    let g = f64::from(GUARD) - 1.0;
    let near = f64::from(view.near);
    let planes: [&dyn Fn(&Hom) -> f64; 5] = [
        &|h| if near.is_finite() { h[3] - near } else { 1.0 },
        &|h| g * h[2] - h[0],
        &|h| g * h[2] + h[0],
        &|h| g * h[2] - h[1],
        &|h| g * h[2] + h[1],
    ];
    for plane in planes {
        n = cut_by(&mut polygon, n, plane);
        if n < 3 {
            return;
        }
    }
    let snapped = |h: &Hom| {
        let q = if view.perspective { 1.0 / h[2] } else { h[3] };
        Corner::snap((h[0] / h[2]) as f32, (h[1] / h[2]) as f32, q as f32)
    };
    let first = snapped(&polygon[0]);
    for k in 1..n - 1 {
        let piece = [first, snapped(&polygon[k]), snapped(&polygon[k + 1])];
        if piece.iter().all(|c| !c.is_outside()) {
            draw(piece);
        }
    }
}

/// Clips a polygon of `n` corners against one plane, in place; returns the new number of corners.
fn cut_by(polygon: &mut [Hom; MAX_CORNERS + 1], n: usize, inside: impl Fn(&Hom) -> f64) -> usize {
    let from = *polygon;
    let mut m = 0;
    let mut push = |h: Hom| {
        if m < MAX_CORNERS {
            polygon[m] = h;
            m += 1;
        }
    };
    for i in 0..n {
        let (a, b) = (from[i], from[(i + 1) % n]);
        let (da, db) = (inside(&a), inside(&b));
        if da >= 0.0 {
            push(a);
        }
        if (da >= 0.0) != (db >= 0.0) {
            // From the inner end: two faces that share the edge get the same bits, hence no crack.
            let (p, q, dp, dq) = if da >= 0.0 {
                (a, b, da, db)
            } else {
                (b, a, db, da)
            };
            let t = dp / (dp - dq);
            push(std::array::from_fn(|k| p[k] + (q[k] - p[k]) * t));
        }
    }
    m
}
