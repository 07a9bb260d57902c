//! Predicates of one triangle: closest point, ray crossing, edge intersection.

use crate::math::{P3, V3d};

/// Barycentric weights of the point of a triangle closest to `p` (Ericson, Real-Time Collision Detection, 5.1.5).
pub fn closest_on_triangle(p: &P3, [a, b, c]: [P3; 3]) -> [f32; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let share = |part: f32, whole: f32| if whole == 0.0 { 0.0 } else { part / whole };
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = share(d1, d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = share(d2, d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = share(d4 - d3, (d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    if sum == 0.0 {
        return [1.0, 0.0, 0.0];
    }
    [va / sum, vb / sum, vc / sum]
}

/// +1 where the ray from `p` along +z leaves through a counter-clockwise triangle, −1 where it enters, else 0.
///
/// Edges are half-open: a ray through an edge crosses exactly one of its two faces.
pub(crate) fn ray_crossing(p: &P3, corners: [P3; 3]) -> i32 {
    // Height and depth where the line x = p.x meets the edge going right and the edge going left.
    let mut cut = [None; 2];
    for k in 0..3 {
        let (a, b) = (&corners[k], &corners[(k + 1) % 3]);
        let (left, beyond) = (a.x < p.x, b.x < p.x);
        if left != beyond {
            let (a, b) = if left { (a, b) } else { (b, a) };
            let (a, d) = (a.cast::<f64>(), (b - a).cast::<f64>());
            let t = (f64::from(p.x) - a.x) / d.x;
            cut[usize::from(!left)] = Some((a.y + t * d.y, a.z + t * d.z));
        }
    }
    let [Some((y0, z0)), Some((y1, z1))] = cut else {
        return 0;
    };
    let y = f64::from(p.y);
    let sign = i32::from(y0 <= y && y < y1) - i32::from(y1 <= y && y < y0);
    if sign != 0 && z0 + (z1 - z0) * (y - y0) / (y1 - y0) > f64::from(p.z) {
        sign
    } else {
        0
    }
}

/// The segment `p q` passes through the triangle `a b c`: opposite sides, and the same turn around all three edges.
pub(super) fn passes_through([p, q]: &[V3d; 2], [a, b, c]: &[V3d; 3]) -> bool {
    let volume = |a: &V3d, b: &V3d, c: &V3d, d: &V3d| (b - a).cross(&(c - a)).dot(&(d - a));
    let normal = (b - a).cross(&(c - a));
    if !(normal.dot(&(p - a)) * normal.dot(&(q - a)) < 0.0) {
        return false;
    }
    let around = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    around.iter().all(|v| *v > 0.0) || around.iter().all(|v| *v < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closest_point_has_its_closed_form_at_face_edge_and_corner() {
        let t = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(P3::from);
        for (p, weights) in [
            ([0.2, 0.3, 0.5], [0.5, 0.2, 0.3]),
            ([0.5, -0.3, 0.4], [0.5, 0.5, 0.0]),
            ([-0.3, 0.25, 0.4], [0.75, 0.0, 0.25]),
            ([1.0, 1.0, 0.0], [0.0, 0.5, 0.5]),
            ([-0.3, -0.4, 0.0], [1.0, 0.0, 0.0]),
            ([2.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ] {
            let got = closest_on_triangle(&P3::from(p), t);
            assert!(
                (0..3).all(|k| (got[k] - weights[k]).abs() < 1e-6),
                "{p:?}: {got:?}"
            );
        }
        let point = closest_on_triangle(&P3::new(0.0, 3.0, 4.0), [t[0]; 3]);
        assert_eq!(point.iter().sum::<f32>(), 1.0, "a triangle without area");
    }
}
