//! Distance from the rim of a sewn tube along its cloth, by the fast-marching update of Kimmel and Sethian (1998), and the
//! girth at each distance.

use std::collections::BTreeMap;
use tryon_garment::GarmentMesh;

/// Most sweeps over all triangles; a tube of 100 rows converges in as many.
const SWEEPS: usize = 400;
/// Change below which a sweep has converged, metres.
const CONVERGED: f64 = 1e-6;

/// Faces of a tube with their flat shapes.
pub(super) struct RimDistance<'a> {
    mesh: &'a GarmentMesh,
    faces: &'a [usize],
}

impl<'a> RimDistance<'a> {
    pub(super) fn new(mesh: &'a GarmentMesh, faces: &'a [usize]) -> Self {
        Self { mesh, faces }
    }
    /// Distance of each simulation vertex from the `rim`, metres; 0 off the faces.
    pub(super) fn to_rim(&self, rim: &[u32]) -> Vec<f64> {
        let mut d = vec![f64::INFINITY; self.mesh.vertices];
        for v in rim {
            d[*v as usize] = 0.0;
        }
        for sweep in 0..SWEEPS {
            let mut change: f64 = 0.0;
            for i in 0..self.faces.len() {
                let f = if sweep % 2 == 0 {
                    self.faces[i]
                } else {
                    self.faces[self.faces.len() - 1 - i]
                };
                let (v, r) = (self.mesh.faces[f].map(|v| v as usize), self.mesh.rest[f]);
                for k in 0..3 {
                    let (a, b) = ((k + 1) % 3, (k + 2) % 3);
                    let new = update(r[k], [r[a], r[b]], [d[v[a]], d[v[b]]]);
                    if new < d[v[k]] {
                        change = change.max((d[v[k]] - new).min(1.0));
                        d[v[k]] = new;
                    }
                }
            }
            if change < CONVERGED {
                break;
            }
        }
        let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
        d.into_iter().map(finite).collect()
    }
}

/// Distance of a corner from those of the other two: by a plane front that passes them within the triangle, else along an
/// edge.
fn update(c: [f64; 2], [a, b]: [[f64; 2]; 2], [da, db]: [f64; 2]) -> f64 {
    let along = |p: [f64; 2], d: f64| d + (p[0] - c[0]).hypot(p[1] - c[1]);
    let edges = along(a, da).min(along(b, db));
    if !da.is_finite() || !db.is_finite() {
        return edges;
    }
    let (u, w) = ([a[0] - c[0], a[1] - c[1]], [b[0] - c[0], b[1] - c[1]]);
    let (uu, uw, ww) = (dot(u, u), dot(u, w), dot(w, w));
    let det = uu * ww - uw * uw;
    if det <= f64::MIN_POSITIVE {
        return edges;
    }
    // Inverse of the Gram matrix; d solves |∇d| = 1.
    let q = [[ww / det, -uw / det], [-uw / det, uu / det]];
    let row = |k: usize, x: [f64; 2]| q[k][0] * x[0] + q[k][1] * x[1];
    let ones = [1.0, 1.0];
    let (one, mixed) = (
        row(0, ones) + row(1, ones),
        row(0, [da, db]) + row(1, [da, db]),
    );
    let square = da * row(0, [da, db]) + db * row(1, [da, db]);
    let root = mixed * mixed - one * (square - 1.0);
    if root < 0.0 {
        return edges;
    }
    let d = (mixed + root.sqrt()) / one;
    let front = [da - d, db - d];
    // The front comes from between the two corners.
    if row(0, front) < 0.0 && row(1, front) < 0.0 {
        d.min(edges)
    } else {
        edges
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Girth of the cloth at each multiple of `level` of the distance, metres: the length of the level line over the part of the
/// turn that it covers.
pub(super) fn level_girths(
    mesh: &GarmentMesh,
    faces: &[usize],
    distance: &[f64],
    azimuth: &[BTreeMap<u32, f64>],
    level: f64,
) -> Vec<f64> {
    let longest = distance.iter().copied().fold(0.0, f64::max);
    let n = (longest / level) as usize + 1;
    let (mut length, mut turn) = (vec![0.0; n], vec![0.0; n]);
    for &f in faces {
        let (v, r) = (mesh.faces[f], mesh.rest[f]);
        let of_panel = &azimuth[usize::from(mesh.face_panel[f])];
        let d = v.map(|v| distance[v as usize]);
        let angle = v.map(|v| of_panel.get(&v).copied().unwrap_or(0.0));
        let low = d.iter().copied().fold(f64::MAX, f64::min);
        let high = d.iter().copied().fold(f64::MIN, f64::max);
        for k in (low / level).ceil() as usize..=((high / level) as usize).min(n - 1) {
            let at = (k as f64 + 1e-3) * level;
            let cut = |i: usize| {
                let j = (i + 1) % 3;
                ((d[i] <= at) != (d[j] <= at)).then(|| {
                    let t = (at - d[i]) / (d[j] - d[i]);
                    let mix = |a: f64, b: f64| a + (b - a) * t;
                    [
                        mix(r[i][0], r[j][0]),
                        mix(r[i][1], r[j][1]),
                        mix(angle[i], angle[j]),
                    ]
                })
            };
            let cuts: Vec<[f64; 3]> = (0..3).filter_map(cut).collect();
            if let [a, b] = cuts[..] {
                length[k] += (a[0] - b[0]).hypot(a[1] - b[1]);
                turn[k] += (a[2] - b[2]).abs();
            }
        }
    }
    let girth = |(l, t): (f64, f64)| {
        let covered = (t / std::f64::consts::TAU).clamp(0.1, 1.0);
        l / covered
    };
    length.into_iter().zip(turn).map(girth).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_front_is_exact_and_a_shadowed_corner_is_reached_along_an_edge() {
        let d = update([0.2, 0.7], [[0.0, 0.0], [1.0, 0.0]], [0.0, 0.0]);
        assert!((d - 0.7).abs() < 1e-12, "{d}");
        let d = update([3.0, 0.4], [[0.0, 0.0], [1.0, 0.0]], [0.0, 0.0]);
        assert!((d - 2f64.hypot(0.4)).abs() < 1e-12, "{d}");
        let to = [0.5, 0.6];
        let at = |p: [f64; 2]| dot(p, [0.6, 0.8]) + 1.0;
        let d = update(
            to,
            [[0.0, 0.0], [1.0, 0.0]],
            [at([0.0, 0.0]), at([1.0, 0.0])],
        );
        assert!((d - at(to)).abs() < 1e-12, "{d}");
    }
}
