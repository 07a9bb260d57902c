//! Neighbours in a cloud without faces: normals, edges and strays.

use super::settings::CloudSettings;
use nalgebra::{Matrix3, Vector3};
use std::collections::{HashMap, HashSet};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::HashGrid;

/// Edges between near points of a cloud, the lower index first, each once: those of the wanted points.
pub(super) fn neighbour_edges(
    points: &[P3],
    settings: &CloudSettings,
    is_wanted: impl Fn(usize) -> bool,
) -> Vec<[u32; 2]> {
    let reach = settings.edge * mean_spacing(points);
    let near = Neighbours::new(points, reach);
    let mut out = Vec::new();
    let mut nearest = vec![(f32::INFINITY, u32::MAX); settings.edges];
    for i in (0..points.len() as u32).filter(|i| is_wanted(*i as usize)) {
        nearest.fill((f32::INFINITY, u32::MAX));
        near.each(i, reach, |j, square| {
            let is_known = j == i || nearest.iter().any(|n| n.1 == j);
            if !is_known && (square, j) < nearest[settings.edges - 1] {
                let at = nearest.partition_point(|n| *n < (square, j));
                nearest[at..].rotate_right(1);
                nearest[at] = (square, j);
            }
        });
        let found = nearest.iter().filter(|n| n.1 != u32::MAX);
        out.extend(found.map(|n| [n.1.min(i), n.1.max(i)]));
    }
    out.sort_unstable();
    out.dedup();
    out
}

/// Order of points along a Morton curve: points near in it are near in space. Shape `[points]`.
pub(super) fn spatial_order(points: &[P3]) -> Vec<u32> {
    /// Side of a cell, metres; 1024 of them cover a person.
    const CELL: f32 = 0.002;
    let spread = |v: f32| {
        let mut bits = ((v / CELL).floor() as i32 & 1023) as u32;
        bits = (bits | (bits << 16)) & 0x0300_00FF;
        bits = (bits | (bits << 8)) & 0x0300_F00F;
        bits = (bits | (bits << 4)) & 0x030C_30C3;
        u64::from((bits | (bits << 2)) & 0x0924_9249)
    };
    let code = |p: &P3| spread(p.x) | (spread(p.y) << 1) | (spread(p.z) << 2);
    let coded = (0..).zip(points).map(|(i, p)| (code(p) << 32) | i);
    let mut coded: Vec<u64> = coded.collect();
    coded.sort_unstable();
    coded.iter().map(|c| *c as u32).collect()
}

/// Points of small pieces apart from the rest: pixels between surfaces, remains of a floor. Shape `[points]`.
pub(super) fn are_strays(points: &[P3], settings: &CloudSettings) -> Vec<bool> {
    let reach = settings.link * mean_spacing(points);
    let most = (settings.stray * points.len() as f64) as usize;
    let near = Neighbours::new(points, reach);
    let mut seen = vec![false; points.len()];
    let mut strays = seen.clone();
    for first in 0..points.len() {
        if std::mem::replace(&mut seen[first], true) {
            continue;
        }
        let mut piece = vec![first as u32];
        let mut next = 0;
        while let Some(i) = piece.get(next).copied() {
            near.each(i, reach, |j, _| {
                if !std::mem::replace(&mut seen[j as usize], true) {
                    piece.push(j);
                }
            });
            next += 1;
        }
        if piece.len() <= most {
            piece.iter().for_each(|i| strays[*i as usize] = true);
        }
    }
    strays
}

/// Normal of the plane through each point and its neighbours, of either sign; zero with fewer than three.
///
/// Few neighbours follow the surface, but noise as large as their distances leaves no plane through them: then more.
pub(super) fn plane_normals(points: &[P3], settings: &CloudSettings) -> Vec<V3> {
    let reach = settings.reach * mean_spacing(points);
    let fewest = settings.neighbours[0] as f32;
    let widest = |k: usize| (k as f32 / fewest).sqrt() * reach;
    let grid = |k| (k, widest(k), Neighbours::new(points, widest(k)));
    let grids = settings.neighbours.map(grid);
    let normal = |i: usize| {
        let mut best = (f64::INFINITY, V3::zeros());
        for (k, reach, grid) in &grids {
            let mut near = grid.of(i as u32, *reach);
            near.truncate(*k);
            if let Some(found) = plane(points, &near).filter(|f| f.0 < best.0) {
                best = found;
            }
            if best.0 < settings.flat {
                break;
            }
        }
        best.1
    };
    let mut out = Vec::new();
    par::map_into(Par::Rayon, points.len(), 256, &mut out, normal);
    out
}

/// Turns normals towards the directions from which the points are seen; false if too many are seen from all sides or none,
/// then of either sign as before. Shapes `[points]`.
///
/// A point that is not seen, or as well from behind, gets no normal.
pub(super) fn turn_outwards(points: &[P3], normals: &mut [V3], settings: &CloudSettings) -> bool {
    /// Angle about the vertical from one direction to the next, radians: the golden one.
    const GOLDEN: f32 = 2.399_963;
    let side = settings.seen_cell * mean_spacing(points);
    let mut toward = vec![V3::zeros(); points.len()];
    for k in 0..settings.directions {
        // Evenly over the sphere, along a spiral.
        let up = (2 * k + 1) as f32 / settings.directions as f32 - 1.0;
        let (sin, cos) = (k as f32 * GOLDEN).sin_cos();
        let flat = (1.0 - up * up).sqrt();
        let direction = V3::new(flat * cos, up, flat * sin);
        let x = V3::new(-sin, 0.0, cos);
        let y = direction.cross(&x);
        let cell = |p: &P3| [x, y].map(|axis| (axis.dot(&p.coords) / side).floor() as i32);
        let mut nearest = HashMap::new();
        for p in points {
            let height = direction.dot(&p.coords);
            let top = nearest.entry(cell(p)).or_insert(height);
            *top = top.max(height);
        }
        for (toward, p) in toward.iter_mut().zip(points) {
            if direction.dot(&p.coords) > nearest[&cell(p)] - settings.seen_depth {
                *toward += direction;
            }
        }
    }
    let facing = |(n, t): (&V3, &V3)| n.dot(t);
    let is_known = |n: &f32| n.abs() > settings.least_facing;
    let along: Vec<f32> = normals.iter().zip(&toward).map(facing).collect();
    let known = along.iter().filter(|n| is_known(n)).count();
    if (known as f64) < settings.most_known * points.len() as f64 {
        return false;
    }
    for (n, along) in normals.iter_mut().zip(&along) {
        *n *= if is_known(along) { along.signum() } else { 0.0 };
    }
    true
}

/// Flatness of some points, 0 to 1, and the normal of their plane; `None` with fewer than three.
fn plane(points: &[P3], some: &[u32]) -> Option<(f64, V3)> {
    if some.len() < 3 {
        return None;
    }
    let at = |i: &u32| points[*i as usize].coords.cast::<f64>();
    let mean = some.iter().map(at).sum::<Vector3<f64>>() / some.len() as f64;
    let from_mean = some.iter().map(|i| at(i) - mean);
    let scatter: Matrix3<f64> = from_mean.map(|d| d * d.transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let across = eigen.eigenvalues.imin();
    let normal = eigen.eigenvectors.column(across).into_owned().cast();
    let mut spread: [f64; 3] = eigen.eigenvalues.into();
    spread.sort_by(f64::total_cmp);
    Some((spread[0] / spread[1].max(f64::MIN_POSITIVE), normal))
}

/// Search of the neighbours of a cloud's points.
struct Neighbours<'a> {
    points: &'a [P3],
    grid: HashGrid,
}

impl<'a> Neighbours<'a> {
    /// Searches within `reach` at most, metres.
    fn new(points: &'a [P3], reach: f32) -> Self {
        let mut grid = HashGrid::default();
        // Searches reach half a cell.
        grid.fill(points, 2.0 * reach);
        Self { points, grid }
    }

    /// Calls `f` with index and squared distance of the points within `reach` of a point, possibly more than once.
    fn each(&self, point: u32, reach: f32, f: impl FnMut(u32, f32)) {
        let at = &self.points[point as usize];
        self.grid.within(at, reach, f);
    }

    /// Points within `reach` of a point, itself included, nearest first.
    fn of(&self, point: u32, reach: f32) -> Vec<u32> {
        let mut near = Vec::new();
        self.each(point, reach, |i, d| near.push((d, i)));
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        // Searches may find a point twice.
        near.dedup();
        near.into_iter().map(|(_, i)| i).collect()
    }
}

/// Typical distance between neighbouring points of a surface, metres: by the number of occupied cells of 3 cm.
pub(super) fn mean_spacing(points: &[P3]) -> f32 {
    const CELL: f32 = 0.03;
    let cell = |p: &P3| [p.x, p.y, p.z].map(|v| (v / CELL).floor() as i32);
    let cells: HashSet<[i32; 3]> = points.iter().map(cell).collect();
    // A surface crosses about 1.5 cells for each square of a cell's side.
    let area = cells.len() as f32 * CELL * CELL / 1.5;
    (area / points.len().max(1) as f32).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two parallel sheets of 1 m, 4 mm apart, whose points lie 6 mm apart.
    fn sheets() -> Vec<P3> {
        let place = |i: usize| [i / 170, i % 170].map(|c| 0.006 * c as f32);
        let point = |i| {
            let [x, z] = place(i);
            P3::new(x, 0.004 * (i % 2) as f32, z)
        };
        (0..170 * 170).map(point).collect()
    }

    #[test]
    fn normals_pass_over_the_distance_of_two_sheets() {
        let points = sheets();
        let normals = plane_normals(&points, &CloudSettings::default());
        let across = normals.iter().filter(|n| n.y.abs() > 0.9).count();
        assert!(across * 100 > points.len() * 98, "{across}");
    }

    #[test]
    fn neighbours_in_the_order_are_near() {
        let mut points = sheets();
        points.push(P3::new(f32::NAN, 0.0, 5e3));
        let order = spatial_order(&points);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(i, v)| i as u32 == *v));
        let near = |w: &&[u32]| {
            let [a, b] = [w[0], w[1]].map(|i| points[i as usize]);
            (a - b).norm() < 0.02
        };
        assert!(order.windows(2).filter(near).count() * 10 > 9 * points.len());
    }

    #[test]
    fn edges_of_wanted_points_are_those_of_all_that_touch_them() {
        let (points, settings) = (sheets(), CloudSettings::default());
        let all = neighbour_edges(&points, &settings, |_| true);
        let some = neighbour_edges(&points, &settings, |i| i < 5000);
        assert!(some.iter().all(|e| all.binary_search(e).is_ok()));
        let inner = |e: &&[u32; 2]| e.iter().all(|v| *v < 5000);
        assert!(all.iter().filter(inner).eq(some.iter().filter(inner)));
    }

    #[test]
    fn small_pieces_apart_are_strays() {
        let (mut points, settings) = (sheets(), CloudSettings::default());
        let count = points.len();
        points.extend([0.3, 0.301].map(|y| P3::new(0.5, y, 0.5)));
        let strays = are_strays(&points, &settings);
        assert_eq!(strays.iter().filter(|s| **s).count(), 2);
        assert!(strays[count] && strays[count + 1]);
        assert!(!are_strays(&sheets(), &settings).contains(&true));
    }
}
