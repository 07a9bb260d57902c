//! Vertices at one position joined.

use super::MeshRepairReport;
use super::surface::WorkingSurface;
use crate::math::P3;
use std::collections::HashMap;

/// Cell of the search grid over the tolerance; smaller visits more cells, larger more points.
const CELL: f32 = 4.0;

/// Joins the vertices of faces that are no farther than `tolerance` from an earlier one; none if it is zero.
/// Removes the faces that collapse.
pub(super) fn join(surface: &mut WorkingSurface, tolerance: f32, report: &mut MeshRepairReport) {
    if !(tolerance > 0.0) {
        return;
    }
    let mut kept: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut joined = vec![u32::MAX; surface.points.len()];
    for i in 0..surface.faces.len() {
        for v in surface.faces[i].corners {
            if joined[v as usize] != u32::MAX {
                continue;
            }
            let first = earlier(&surface.points, &kept, v, tolerance);
            joined[v as usize] = first.unwrap_or(v);
            if first.is_none() {
                let p = &surface.points[v as usize];
                kept.entry(cell(p, tolerance, 0.0)).or_default().push(v);
            } else {
                report.joined += 1;
            }
        }
        let face = &mut surface.faces[i];
        face.corners = face.corners.map(|v| joined[v as usize]);
    }
    surface.faces.retain(|f| {
        let [a, b, c] = f.corners;
        let is_open = a != b && b != c && c != a;
        if !is_open {
            report.collapsed.add(f.face);
        }
        is_open
    });
}

/// Cell of a position moved by `shift` along each axis.
fn cell(p: &P3, tolerance: f32, shift: f32) -> [i64; 3] {
    [p.x, p.y, p.z].map(|c| ((c + shift) / (CELL * tolerance)).floor() as i64)
}

/// Kept vertex within `tolerance` of vertex `v`.
fn earlier(
    points: &[P3],
    kept: &HashMap<[i64; 3], Vec<u32>>,
    v: u32,
    tolerance: f32,
) -> Option<u32> {
    let p = &points[v as usize];
    let (lo, hi) = (
        cell(p, tolerance, -tolerance),
        cell(p, tolerance, tolerance),
    );
    for x in lo[0]..=hi[0] {
        for y in lo[1]..=hi[1] {
            for z in lo[2]..=hi[2] {
                let near = kept.get(&[x, y, z]).into_iter().flatten();
                let mut near = near.filter(|w| (points[**w as usize] - p).norm() <= tolerance);
                if let Some(w) = near.next() {
                    return Some(*w);
                }
            }
        }
    }
    None
}
