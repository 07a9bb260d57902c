//! Grid of faces for short rays.

use super::super::surface::WorkingSurface;
use crate::math::{P3d, V3d};
use std::collections::HashMap;

/// Most cells of a face; larger faces are tested against every ray.
const MOST_CELLS: i64 = 4096;
/// Determinant, over the product of lengths, below which ray and face are parallel.
const PARALLEL: f64 = 1e-9;

/// Faces by the cells that their bounding boxes overlap.
pub(super) struct FaceGrid<'a> {
    surface: &'a WorkingSurface,
    cells: HashMap<[i64; 3], Vec<u32>>,
    large: Vec<u32>,
    cell: f64,
    reach: f64,
}

impl<'a> FaceGrid<'a> {
    /// Grid of `faces` for rays of length `reach`.
    pub(super) fn new(surface: &'a WorkingSurface, faces: &[u32], reach: f64) -> Self {
        let corners = |f: u32| surface.positions(f as usize).map(|p| p.cast::<f64>());
        let lengths = faces.iter().map(|f| {
            let [a, b, c] = corners(*f);
            ((b - a).norm() + (c - b).norm() + (a - c).norm()) / 3.0
        });
        let mean = lengths.sum::<f64>() / faces.len().max(1) as f64;
        let mut out = Self {
            surface,
            cells: HashMap::new(),
            large: Vec::new(),
            cell: reach.max(mean).max(f64::MIN_POSITIVE),
            reach,
        };
        for &f in faces {
            let [a, b, c] = corners(f);
            let (lo, hi) = out.range(&a.inf(&b).inf(&c), &a.sup(&b).sup(&c));
            let count: i64 = (0..3)
                .map(|k| hi[k].saturating_sub(lo[k]).saturating_add(1))
                .fold(1, i64::saturating_mul);
            if count > MOST_CELLS {
                out.large.push(f);
            } else {
                for_cells(lo, hi, |key| out.cells.entry(key).or_default().push(f));
            }
        }
        out
    }

    /// First face that the ray from `from`, in unit `direction`, hits within reach, and the distance. Face `own` is left out.
    pub(super) fn first_hit(&self, own: u32, from: &P3d, direction: &V3d) -> Option<(u32, f64)> {
        let to = from + direction * self.reach;
        let (lo, hi) = self.range(&from.inf(&to), &from.sup(&to));
        let mut best: Option<(u32, f64)> = None;
        let mut test = |f: u32| {
            let nearest = best.map_or(self.reach, |b| b.1);
            if f != own
                && let Some(t) = self.hit(f, from, direction)
                && t < nearest
            {
                best = Some((f, t));
            }
        };
        self.large.iter().for_each(|f| test(*f));
        for_cells(lo, hi, |key| {
            let faces = self.cells.get(&key).into_iter().flatten();
            faces.for_each(|f| test(*f));
        });
        best
    }

    /// Cells of the corners of a box.
    fn range(&self, lo: &P3d, hi: &P3d) -> ([i64; 3], [i64; 3]) {
        let cell = |p: &P3d| [p.x, p.y, p.z].map(|c| (c / self.cell).floor() as i64);
        (cell(lo), cell(hi))
    }

    /// Distance at which a ray hits a face (Möller & Trumbore 1997).
    fn hit(&self, face: u32, from: &P3d, direction: &V3d) -> Option<f64> {
        let [a, b, c] = self
            .surface
            .positions(face as usize)
            .map(|p| p.cast::<f64>());
        let (u, v) = (b - a, c - a);
        let across = direction.cross(&v);
        let determinant = u.dot(&across);
        if determinant.abs() <= PARALLEL * u.norm() * v.norm() {
            return None;
        }
        let arm = from - a;
        let x = arm.dot(&across) / determinant;
        let turned = arm.cross(&u);
        let y = direction.dot(&turned) / determinant;
        let t = v.dot(&turned) / determinant;
        (x >= 0.0 && y >= 0.0 && x + y <= 1.0 && t > 0.0).then_some(t)
    }
}

/// Visits the cells of a box.
fn for_cells(lo: [i64; 3], hi: [i64; 3], mut visit: impl FnMut([i64; 3])) {
    for x in lo[0]..=hi[0] {
        for y in lo[1]..=hi[1] {
            for z in lo[2]..=hi[2] {
                visit([x, y, z]);
            }
        }
    }
}
