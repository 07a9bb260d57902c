//! Carrying cloth with a body that has jumped: every joint's rigid motion, blended like skin.

use super::Model;
use crate::math::{P3, polar_rotation_3};
use nalgebra::{Isometry3, Matrix3, Matrix3x4, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Rigid motion of each joint's vertices from `from` to `to` (Kabsch), parents standing in where a joint has no skin.
fn joint_motions(model: &Model, from: &[P3], to: &[P3]) -> Vec<Isometry3<f64>> {
    let n = model.joints;
    let w = &model.weights;
    let mut sums = vec![(0.0, Vector3::zeros(), Vector3::zeros(), Matrix3::zeros()); n];
    for (i, (a, b)) in from.iter().zip(to).enumerate() {
        let (a, b) = (a.coords.cast::<f64>(), b.coords.cast::<f64>());
        let s = &mut sums[w.dominant(i)];
        s.0 += 1.0;
        s.1 += a;
        s.2 += b;
        s.3 += b * a.transpose();
    }
    let all = sums.iter().fold((0.0, Vector3::zeros(), Vector3::zeros(), Matrix3::zeros()), |t, s| {
        (t.0 + s.0, t.1 + s.1, t.2 + s.2, t.3 + s.3)
    });
    let fit = |s: &(f64, Vector3<f64>, Vector3<f64>, Matrix3<f64>)| {
        let (ca, cb) = (s.1 / s.0, s.2 / s.0);
        let r = polar_rotation_3(&(s.3 - cb * ca.transpose() * s.0));
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(r));
        Isometry3::from_parts(Translation3::from(cb - q * ca), q)
    };
    /// Fewer vertices than this don't fix a rotation.
    const ENOUGH: f64 = 12.0;
    let whole = if all.0 >= 1.0 { fit(&all) } else { Isometry3::identity() };
    sums.iter().map(|s| if s.0 >= ENOUGH { fit(s) } else { whole }).collect()
}

/// Moves `positions` as skin bound to the body at `nearest` (one body vertex each) would.
/// Weights are averaged over cloth neighbours, so that neighbours bound to two limbs are not torn apart.
pub(super) fn carry(
    model: &Model,
    edges: &[([u32; 2], f64)],
    nearest: &[[u32; 2]],
    from: &[P3],
    to: &[P3],
    positions: &mut [P3],
) {
    /// Rounds of averaging weights: a hand's width on the cloth.
    const ROUNDS: usize = 6;
    let motions: Vec<Matrix3x4<f64>> = joint_motions(model, from, to)
        .iter()
        .map(|m| m.to_homogeneous().fixed_view::<3, 4>(0, 0).into_owned())
        .collect();
    let j = motions.len();
    let mut weights = vec![0.0f64; positions.len() * j];
    for (i, n) in nearest.iter().enumerate() {
        let v = n[0] as usize;
        for k in 0..4 {
            weights[i * j + usize::from(model.weights.joints[v][k])] += f64::from(model.weights.weights[v][k]);
        }
    }
    for _ in 0..ROUNDS {
        let mut next = weights.clone();
        let mut count = vec![1.0f64; positions.len()];
        for ([a, b], _) in edges {
            let (a, b) = (*a as usize, *b as usize);
            count[a] += 1.0;
            count[b] += 1.0;
            for k in 0..j {
                next[a * j + k] += weights[b * j + k];
                next[b * j + k] += weights[a * j + k];
            }
        }
        for (i, c) in count.iter().enumerate() {
            next[i * j..(i + 1) * j].iter_mut().for_each(|w| *w /= c);
        }
        weights = next;
    }
    for (i, p) in positions.iter_mut().enumerate() {
        let m = (0..j).fold(Matrix3x4::zeros(), |s, k| s + motions[k] * weights[i * j + k]);
        let q: Point3<f64> = Point3::from(m * p.cast::<f64>().to_homogeneous());
        *p = q.cast();
    }
}
