//! Which step is stable: a bound from every element, and the largest eigenvalue of M⁻¹K of the flat sheet.

use super::plan::edge_stiffness;
use crate::cloth::Sheet;
use nalgebra::{Matrix6, Vector2, Vector6};

/// Largest eigenvalue of each element over the inertia it has at its lightest corner's share, 1/s². No eigenvalue of
/// the whole is above the largest of these (Irons and Treharne 1971).
pub(super) fn element_limits(sheet: &Sheet, springs_only: bool) -> Vec<f64> {
    let mut around = vec![0.0; sheet.mass.len()];
    for e in &sheet.elements {
        for v in e.v {
            around[v as usize] += e.area;
        }
    }
    sheet
        .elements
        .iter()
        .map(|e| {
            let Some((k, along)) = edge_stiffness(sheet, e) else { return 0.0 };
            let u: [Vector6<f64>; 3] = std::array::from_fn(|i| {
                let (a, b) = ((i + 1) % 3, (i + 2) % 3);
                let mut u = Vector6::zeros();
                for d in 0..2 {
                    u[2 * a + d] -= along[i][d];
                    u[2 * b + d] += along[i][d];
                }
                u
            });
            let mut m = Matrix6::zeros();
            for i in 0..3 {
                for j in 0..3 {
                    if i == j || !springs_only {
                        m += u[i] * u[j].transpose() * k[(i, j)];
                    }
                }
            }
            // Each corner lends the element the share of its mass that the element's area has around it.
            let share = e.v.map(|v| sheet.mass[v as usize] * e.area / around[v as usize]);
            let scale = Vector6::from_fn(|i, _| 1.0 / share[i / 2].sqrt());
            let scaled = Matrix6::from_fn(|i, j| m[(i, j)] * scale[i] * scale[j]);
            scaled.symmetric_eigenvalues().max()
        })
        .collect()
}

/// Largest eigenvalue of M⁻¹K of the sheet laid flat, 1/s², by power iteration; `keep` is the share of its stiffness
/// that each element has. (Across the sheet only bending acts, which is far softer.)
pub(super) fn largest_eigenvalue(sheet: &Sheet, keep: &[f64], springs_only: bool) -> f64 {
    /// Products; after these the estimate lies a few percent below, which the margin covers.
    const PRODUCTS: usize = 40;
    let n = sheet.mass.len();
    let terms: Vec<_> = sheet
        .elements
        .iter()
        .zip(keep)
        .filter_map(|(e, keep)| edge_stiffness(sheet, e).map(|(k, along)| (e.v, k * *keep, along)))
        .collect();
    let mut x: Vec<Vector2<f64>> = (0..n)
        .map(|i| {
            let r = (i as u32).wrapping_mul(2_654_435_761);
            Vector2::new(f64::from(r & 0xffff) - 32_767.5, f64::from(r >> 16) - 32_767.5)
        })
        .collect();
    let mut y = vec![Vector2::zeros(); n];
    let mut value = 0.0;
    for _ in 0..PRODUCTS {
        y.fill(Vector2::zeros());
        for (v, k, along) in &terms {
            let d: [f64; 3] =
                std::array::from_fn(|i| along[i].dot(&(x[v[(i + 2) % 3] as usize] - x[v[(i + 1) % 3] as usize])));
            for i in 0..3 {
                let t: f64 = (0..3).filter(|j| *j == i || !springs_only).map(|j| k[(i, j)] * d[j]).sum();
                y[v[(i + 1) % 3] as usize] -= along[i] * t;
                y[v[(i + 2) % 3] as usize] += along[i] * t;
            }
        }
        let (mut norm, mut whole) = (0.0, 0.0);
        for i in 0..n {
            y[i] /= sheet.mass[i];
            whole += x[i].norm_squared() * sheet.mass[i];
            norm += y[i].norm_squared() * sheet.mass[i];
        }
        value = (norm / whole.max(f64::MIN_POSITIVE)).sqrt();
        let scale = 1.0 / norm.sqrt().max(f64::MIN_POSITIVE);
        x.iter_mut().zip(&y).for_each(|(x, y)| *x = y * scale);
    }
    value
}
