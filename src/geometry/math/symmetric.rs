//! Symmetric matrices: nearest positive semi-definite matrix and principal axes.

use nalgebra::allocator::Allocator;
use nalgebra::{
    DefaultAllocator, DimDiff, DimSub, Matrix3, OMatrix, Point3, SymmetricEigen, U1, Vector3,
};

/// Nearest positive semi-definite matrix in the Frobenius norm (negative eigenvalues become zero).
pub fn project_psd<D: DimSub<U1>>(m: &OMatrix<f64, D, D>) -> OMatrix<f64, D, D>
where
    DefaultAllocator: Allocator<D, D> + Allocator<D> + Allocator<DimDiff<D, U1>>,
{
    let e = SymmetricEigen::new(m.clone());
    let mut scaled = e.eigenvectors.clone();
    for (k, mut column) in scaled.column_iter_mut().enumerate() {
        column *= e.eigenvalues[k].max(0.0);
    }
    scaled * e.eigenvectors.transpose()
}

/// Centroid, orthonormal axes (columns) and variances of a cloud, largest variance first.
/// `None` without points or with a non-finite one.
pub fn principal_axes(points: &[Point3<f32>]) -> Option<(Point3<f64>, Matrix3<f64>, Vector3<f64>)> {
    if points.is_empty() {
        return None;
    }
    let n = points.len() as f64;
    let mean = points
        .iter()
        .fold(Vector3::zeros(), |a, p| a + p.coords.cast::<f64>())
        / n;
    let cov = points.iter().fold(Matrix3::zeros(), |a, p| {
        let d = p.coords.cast::<f64>() - mean;
        a + d * d.transpose()
    }) / n;
    if !cov.iter().all(|v| v.is_finite()) {
        return None;
    }
    let e = SymmetricEigen::new(cov);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| e.eigenvalues[b].total_cmp(&e.eigenvalues[a]));
    let axes = Matrix3::from_columns(&order.map(|i| e.eigenvectors.column(i).into_owned()));
    let variances = Vector3::from_fn(|i, _| e.eigenvalues[order[i]].max(0.0));
    Some((Point3::from(mean), axes, variances))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    #[test]
    fn projection_clears_negative_directions_only() {
        let m = Matrix2::new(2.0, 1.5, 1.5, -1.0);
        let p = project_psd(&m);
        assert!(p.symmetric_eigenvalues().iter().all(|v| *v > -1e-12));
        // The other part of m is negative and orthogonal to p.
        assert!((p * (m - p)).norm() < 1e-12 && (m - p).trace() < 0.0);
        let positive = Matrix2::new(2.0, 0.5, 0.5, 1.0);
        assert!((project_psd(&positive) - positive).norm() < 1e-12);
        assert!(project_psd(&Matrix2::new(-1.0, 0.0, 0.0, -2.0)).norm() < 1e-12);
    }

    #[test]
    fn axes_of_a_stretched_cloud() {
        let pts: Vec<_> = (0..100)
            .map(|i| Point3::new(0.01 * (i % 3) as f32, i as f32 * 0.02, 0.0))
            .collect();
        let (_, axes, var) = principal_axes(&pts).expect("points given");
        assert!(axes.column(0).y.abs() > 0.999 && var[0] > var[1] && var[1] >= var[2]);
        assert!(principal_axes(&[]).is_none());
        assert!(principal_axes(&[Point3::new(f32::NAN, 0.0, 0.0)]).is_none());
    }
}
