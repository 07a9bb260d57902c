//! Carrying cloth without computing it: with a body that has jumped by every joint's rigid motion, blended like skin; with
//! one that sways while cloth sleeps by the way of the skin beneath.

use super::Model;
use super::regions::wake_all;
use super::state::State;
use crate::contact::SurfaceFrame;
use crate::math::{P3, V3, polar_rotation_3};
use nalgebra::{
    Isometry3, Matrix3, Matrix3x4, Point3, Rotation3, Translation3, UnitQuaternion, Vector3,
};

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
    let all = sums.iter().fold(
        (0.0, Vector3::zeros(), Vector3::zeros(), Matrix3::zeros()),
        |t, s| (t.0 + s.0, t.1 + s.1, t.2 + s.2, t.3 + s.3),
    );
    let fit = |s: &(f64, Vector3<f64>, Vector3<f64>, Matrix3<f64>)| {
        let (ca, cb) = (s.1 / s.0, s.2 / s.0);
        let r = polar_rotation_3(&(s.3 - cb * ca.transpose() * s.0));
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(r));
        Isometry3::from_parts(Translation3::from(cb - q * ca), q)
    };
    /// Fewer vertices than this don't fix a rotation.
    const ENOUGH: f64 = 12.0;
    let whole = if all.0 >= 1.0 {
        fit(&all)
    } else {
        Isometry3::identity()
    };
    sums.iter()
        .map(|s| if s.0 >= ENOUGH { fit(s) } else { whole })
        .collect()
}

/// Puts rings of sleeves that lost their arm around it again, at rest on the body of the last call. Says how many.
pub(super) fn put_back(model: &Model, state: &mut State) -> usize {
    let lines = model.arms.lines(&state.body);
    let mut count = 0;
    for (g, m) in state.garments.iter_mut().zip(&model.garments) {
        for sleeve in &m.sleeves {
            let found = sleeve.lost(&lines, |v| g.positions[v as usize]);
            if found.is_empty() {
                continue;
            }
            count += found.len();
            let (vertices, places): (Vec<u32>, Vec<P3>) = found
                .iter()
                .flat_map(|f| {
                    f.ring
                        .iter()
                        .map(|v| (*v, f.way * g.positions[*v as usize]))
                })
                .unzip();
            let frame = SurfaceFrame {
                vertices: state.body.clone(),
                normals: Vec::new(),
            };
            let masks = vertices.iter().map(|v| &m.own[*v as usize]);
            let near = model
                .surface
                .nearest_vertices(model.config.par, &frame, &places, masks);
            for ((v, to), near) in vertices.into_iter().zip(places).zip(near) {
                g.positions[v as usize] = to;
                g.velocities[v as usize] = V3::zeros();
                g.nearest[v as usize][0] = near;
            }
        }
    }
    if count > 0 {
        wake_all(state);
    }
    count
}

/// Rounds of averaging over cloth neighbours, so that cloth between two legs goes with both: a hand's width on the cloth.
const ROUNDS: usize = 6;

/// Moves sleeping cloth by the way of the skin at `nearest` (one body vertex each), averaged over cloth neighbours. Ways are
/// sums, so that a body that comes back brings its cloth back, whatever way it took.
pub(super) fn ride(
    edges: &[([u32; 2], f64)],
    nearest: &[[u32; 2]],
    from: &[P3],
    to: &[P3],
    positions: &mut [P3],
) {
    let ways = ways(edges, nearest, from, to, |_| true);
    positions.iter_mut().zip(&ways).for_each(|(p, w)| *p += w);
}

/// The way of the skin under each vertex that `rides`, averaged over neighbours that do.
pub(super) fn ways(
    edges: &[([u32; 2], f64)],
    nearest: &[[u32; 2]],
    from: &[P3],
    to: &[P3],
    rides: impl Fn(usize) -> bool,
) -> Vec<V3> {
    let mut ways: Vec<V3> = nearest
        .iter()
        .map(|n| to[n[0] as usize] - from[n[0] as usize])
        .collect();
    let mut counts = vec![1.0f32; ways.len()];
    let edges: Vec<[u32; 2]> = edges
        .iter()
        .map(|(v, _)| *v)
        .filter(|v| rides(v[0] as usize) && rides(v[1] as usize))
        .collect();
    edges
        .iter()
        .flatten()
        .for_each(|v| counts[*v as usize] += 1.0);
    let mut sums = ways.clone();
    for _ in 0..ROUNDS {
        for [a, b] in edges.iter().map(|v| v.map(|v| v as usize)) {
            sums[a] += ways[b];
            sums[b] += ways[a];
        }
        sums.iter_mut().zip(&counts).for_each(|(s, n)| *s /= *n);
        ways.copy_from_slice(&sums);
    }
    ways
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
    let motions: Vec<Matrix3x4<f64>> = joint_motions(model, from, to)
        .iter()
        .map(|m| m.to_homogeneous().fixed_view::<3, 4>(0, 0).into_owned())
        .collect();
    let j = motions.len();
    let mut weights = vec![0.0f64; positions.len() * j];
    for (i, n) in nearest.iter().enumerate() {
        let v = n[0] as usize;
        for k in 0..4 {
            weights[i * j + usize::from(model.weights.joints[v][k])] +=
                f64::from(model.weights.weights[v][k]);
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
        let m = (0..j).fold(Matrix3x4::zeros(), |s, k| {
            s + motions[k] * weights[i * j + k]
        });
        let q: Point3<f64> = Point3::from(m * p.cast::<f64>().to_homogeneous());
        *p = q.cast();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    #[test]
    fn cloth_rides_with_the_skin_beneath_and_comes_back_with_it() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(4);
        let mut some =
            |by: f32| V3::new(0.0, 0.0, 0.0).map(|_: f32| by * rng.random_range(-1.0f32..1.0));
        // A strip over the first half of some skin.
        let skin: Vec<P3> = (0..40)
            .map(|i| P3::new(0.02 * i as f32, 0.0, 0.0))
            .collect();
        let cloth: Vec<P3> = skin[..20]
            .iter()
            .map(|p| p + V3::new(0.0, 0.01, 0.0))
            .collect();
        let nearest: Vec<[u32; 2]> = (0..20).map(|i| [i, i]).collect();
        let edges: Vec<([u32; 2], f64)> = (1..20).map(|i| ([i - 1, i], 0.02)).collect();
        let whole = some(0.01);
        let mut there = cloth.clone();
        let moved: Vec<P3> = skin.iter().map(|p| p + whole).collect();
        ride(&edges, &nearest, &skin, &moved, &mut there);
        assert!(
            there
                .iter()
                .zip(&cloth)
                .all(|(a, b)| (a - b - whole).norm() < 1e-6),
            "as the skin as one"
        );
        let (mut at, mut last) = (cloth.clone(), skin.clone());
        for step in 0..1000 {
            let next: Vec<P3> = if step == 999 {
                skin.clone()
            } else {
                skin.iter().map(|p| p + some(0.01)).collect()
            };
            ride(&edges, &nearest, &last, &next, &mut at);
            last = next;
        }
        let off = at
            .iter()
            .zip(&cloth)
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f32::max);
        assert!(off < 2e-5, "{off} m off after a thousand ways and back");
    }
}
