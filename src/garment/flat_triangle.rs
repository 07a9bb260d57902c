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

/// A triangle with positive area, widened across its longest side until its height is at least `share` of that.
pub fn widened(mut t: [[f64; 2]; 3], share: f64) -> [[f64; 2]; 3] {
    let side = |k: usize| {
        let (a, b) = (t[k], t[(k + 1) % 3]);
        (b[0] - a[0]).hypot(b[1] - a[1])
    };
    let k = (0..3).fold(0, |most, k| if side(k) > side(most) { k } else { most });
    let length = side(k);
    let lacking = share * length - 2.0 * rest_area(&t) / length.max(f64::MIN_POSITIVE);
    if lacking > 0.0 {
        let (a, b) = (t[k], t[(k + 1) % 3]);
        let c = &mut t[(k + 2) % 3];
        c[0] -= (b[1] - a[1]) / length * lacking;
        c[1] += (b[0] - a[0]) / length * lacking;
    }
    t
}

/// A triangle in space unfolded into the plane: first edge along x.
pub fn unfold(p: [Vector3<f64>; 3]) -> [[f64; 2]; 3] {
    let (a, b) = (p[1] - p[0], p[2] - p[0]);
    let x = a.norm().max(f64::MIN_POSITIVE);
    [[0.0; 2], [x, 0.0], [a.dot(&b) / x, a.cross(&b).norm() / x]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slivers_are_widened_across_their_longest_side_and_others_stay() {
        let even = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.8]];
        assert_eq!(widened(even, 0.1), even);
        // The longest side is the second, from (0, 1) to (0, -1).
        let sliver = [[-1e-9, 0.25], [0.0, -1.0], [0.0, 1.0]];
        let wide = widened(sliver, 0.1);
        assert!((rest_area(&wide) - 0.2).abs() < 1e-9, "{wide:?}");
        assert!(
            (wide[0][0] + 0.2).abs() < 1e-9 && wide[0][1] == 0.25,
            "{wide:?}"
        );
        assert_eq!(wide[1..], sliver[1..]);
        assert_eq!(widened([[0.0; 2]; 3], 0.1), [[0.0; 2]; 3]);
    }
}
