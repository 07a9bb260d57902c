//! The rotation nearest to a matrix (polar decomposition), never a reflection.

use nalgebra::Matrix3;

/// Rotation closest to `f` in the Frobenius norm (Kabsch: the smallest singular direction flips when det < 0).
pub fn polar_rotation_3(f: &Matrix3<f64>) -> Matrix3<f64> {
    let svd = f.svd(true, true);
    let (Some(u), Some(vt)) = (svd.u, svd.v_t) else {
        return Matrix3::identity();
    };
    let mut d = Matrix3::identity();
    if (u * vt).determinant() < 0.0 {
        // nalgebra sorts singular values in descending order, so the last one is the smallest.
        d[(2, 2)] = -1.0;
    }
    u * d * vt
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};

    #[test]
    fn recovers_the_rotation_of_a_stretched_matrix() {
        let r = Rotation3::new(Vector3::new(0.3, -1.1, 0.4)).into_inner();
        let s = Matrix3::new(2.0, 0.1, 0.0, 0.1, 1.0, 0.2, 0.0, 0.2, 0.5);
        assert!((polar_rotation_3(&(r * s)) - r).norm() < 1e-12);
    }

    #[test]
    fn degenerate_matrices_still_give_rotations() {
        for f in [
            Matrix3::zeros(),
            Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0)),
            Matrix3::from_element(1.0),
        ] {
            let r = polar_rotation_3(&f);
            assert!((r.determinant() - 1.0).abs() < 1e-12);
            assert!((r * r.transpose() - Matrix3::identity()).norm() < 1e-12);
        }
    }
}
