//! Exponential and logarithm of so(3) and se(3), stable at zero and at half a turn.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

/// Below this angle (radians) closed forms lose more digits than their Taylor series of order θ⁴:
/// the first neglected term is θ⁶/5040 ≈ 2e-28 here.
const SMALL_ANGLE: f64 = 1e-4;

/// A twist ξ = (v, ω): linear part first (metres), then angular part (radians). Ye et al. 2014, eq. 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// Linear part, metres.
    pub linear: Vector3<f64>,
    /// Angular part, radians.
    pub angular: Vector3<f64>,
}

impl Twist {
    /// The rotation about `axis` (unit length) through `point`: ξ = (p × ω, ω).
    pub fn revolute(axis: Vector3<f64>, point: Vector3<f64>) -> Self {
        Self {
            linear: point.cross(&axis),
            angular: axis,
        }
    }
    /// Velocity of a point under this twist: v + ω × p.
    pub fn velocity_at(&self, p: &Vector3<f64>) -> Vector3<f64> {
        self.linear + self.angular.cross(p)
    }
    /// The same motion seen from another frame: the adjoint of `iso` applied to this twist.
    pub fn transformed(&self, iso: &Isometry3<f64>) -> Self {
        let angular = iso.rotation * self.angular;
        let linear = iso.rotation * self.linear + iso.translation.vector.cross(&angular);
        Self { linear, angular }
    }
}

/// The matrix of the cross product: `skew(a) * b == a × b`.
pub fn skew(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// Rotation of angle ‖ω‖ about ω.
pub fn exp_so3(omega: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(*omega)
}

/// Rotation vector of a rotation, length in [0, π].
pub fn log_so3(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    // atan2 of the vector part is accurate at both ends, where acos(w) is not.
    let (w, v) = (q.w, q.imag());
    let (w, v) = if w < 0.0 { (-w, -v) } else { (w, v) };
    let s = v.norm();
    if s < SMALL_ANGLE {
        // 2·atan(s/w)/s → 2/w·(1 − s²/(3w²))
        return v * (2.0 / w * (1.0 - s * s / (3.0 * w * w)));
    }
    v * (2.0 * s.atan2(w) / s)
}

/// Left Jacobian of SO(3): d/dt of exp(ω + tδ) is `skew(J δ) exp(ω)`.
pub fn left_jacobian_so3(omega: &Vector3<f64>) -> Matrix3<f64> {
    let t2 = omega.norm_squared();
    let t = t2.sqrt();
    let (a, b) = if t < SMALL_ANGLE {
        (0.5 - t2 / 24.0, 1.0 / 6.0 - t2 / 120.0)
    } else {
        ((1.0 - t.cos()) / t2, (t - t.sin()) / (t2 * t))
    };
    let k = skew(omega);
    Matrix3::identity() + k * a + k * k * b
}

/// Rigid motion of the twist, e^ξ̂. Ye et al. 2014, eq. 1.
pub fn exp_se3(xi: &Twist) -> Isometry3<f64> {
    let translation = left_jacobian_so3(&xi.angular) * xi.linear;
    Isometry3::from_parts(Translation3::from(translation), exp_so3(&xi.angular))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
        (-limit..limit, -limit..limit, -limit..limit).prop_map(|(x, y, z)| Vector3::new(x, y, z))
    }

    proptest! {
        #[test]
        fn exp_matches_the_matrix_series(v in vector(1.0), w in vector(1.5)) {
            // Oracle: the power series of eq. 1 summed on 4×4 matrices.
            let mut xi = nalgebra::Matrix4::zeros();
            xi.fixed_view_mut::<3, 3>(0, 0).copy_from(&skew(&w));
            xi.fixed_view_mut::<3, 1>(0, 3).copy_from(&v);
            let (mut sum, mut term) = (nalgebra::Matrix4::identity(), nalgebra::Matrix4::identity());
            for k in 1..60 { term = term * xi / f64::from(k); sum += term; }
            let ours = exp_se3(&Twist { linear: v, angular: w }).to_homogeneous();
            prop_assert!((ours - sum).norm() < 1e-10);
        }

        #[test]
        fn left_jacobian_is_the_derivative(w in vector(1.5), d in vector(1.0)) {
            let h = 1e-6;
            let moved = exp_so3(&(w + d * h)) * exp_so3(&w).inverse();
            let fd = log_so3(&moved) / h;
            prop_assert!((fd - left_jacobian_so3(&w) * d).norm() < 1e-5);
        }
    }

    #[test]
    fn small_and_half_turns_round_trip() {
        for angle in [
            0.0,
            1e-12,
            1e-8,
            9.9e-5,
            1.01e-4,
            3.0,
            std::f64::consts::PI - 1e-9,
        ] {
            let w = Vector3::new(0.6, -0.48, 0.64) * angle;
            assert!((log_so3(&exp_so3(&w)) - w).norm() < 1e-9, "angle {angle}");
        }
    }

    #[test]
    fn adjoint_moves_the_axis() {
        let iso = Isometry3::new(Vector3::new(0.3, -0.2, 1.0), Vector3::new(0.1, 0.7, -0.4));
        let (axis, point) = (Vector3::z(), Vector3::new(0.2, 0.1, 0.0));
        let moved = Twist::revolute(axis, point).transformed(&iso);
        let expected = Twist::revolute(
            iso.rotation * axis,
            iso * nalgebra::Point3::from(point) - nalgebra::Point3::origin(),
        );
        assert!((moved.linear - expected.linear).norm() < 1e-12);
        assert!((moved.angular - expected.angular).norm() < 1e-12);
    }
}
