//! Flat triangles: the rest shape of cloth, counter-clockwise corners in panel coordinates, metres.

use nalgebra::Vector3;

/// Signed area, m².
pub fn rest_area(t: &[[f64; 2]; 3]) -> f64 {
    0.5 * ((t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]))
}

/// Smallest angle, degrees.
pub(super) fn smallest_angle(t: &[[f64; 2]; 3]) -> f64 {
    (0..3)
        .map(|k| {
            let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
            let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
            (u[0] * v[1] - u[1] * v[0])
                .abs()
                .atan2(u[0] * v[0] + u[1] * v[1])
                .to_degrees()
        })
        .fold(180.0, f64::min)
}

/// A triangle in space unfolded into the plane: first edge along x.
pub(crate) fn unfold(p: [Vector3<f64>; 3]) -> [[f64; 2]; 3] {
    let (a, b) = (p[1] - p[0], p[2] - p[0]);
    let x = a.norm().max(f64::MIN_POSITIVE);
    [[0.0; 2], [x, 0.0], [a.dot(&b) / x, a.cross(&b).norm() / x]]
}
