//! Neighbour queries by exhaustive scan: the oracles, and the faster way for a few hundred points.

use crate::math::P3;

/// Index and squared distance of the point nearest to `query` within `radius`; the smaller index wins a tie.
pub fn nearest_brute_force(points: &[P3], query: &P3, radius: f32) -> Option<(usize, f32)> {
    let mut best = None;
    let mut bound = radius * radius;
    for (i, p) in points.iter().enumerate() {
        let d = (p - query).norm_squared();
        if d < bound {
            bound = d;
            best = Some((i, d));
        }
    }
    best
}

#[cfg(test)]
pub(in crate::spatial) use meshes::*;

#[cfg(test)]
mod meshes {
    use super::P3;
    use crate::math::V3d;
    use crate::mesh::{Face, edges};
    use crate::spatial::triangle::{closest_on_triangle, passes_through, ray_crossing};

    /// Winding number by the crossings of a ray with every triangle.
    pub(in crate::spatial) fn winding_number(faces: &[Face], x: &[P3], p: &P3) -> i32 {
        let corners = |f: &Face| f.map(|v| x[v as usize]);
        faces.iter().map(|f| ray_crossing(p, corners(f))).sum()
    }

    /// Distance to the nearest triangle, metres.
    pub(in crate::spatial) fn distance(faces: &[Face], x: &[P3], p: &P3) -> f32 {
        let to = |f: &Face| {
            let c = f.map(|v| x[v as usize]);
            let w = closest_on_triangle(p, c);
            (c[0].coords * w[0] + c[1].coords * w[1] + c[2].coords * w[2] - p.coords).norm()
        };
        faces.iter().map(to).fold(f32::INFINITY, f32::min)
    }

    /// Triangles whose bounding boxes overlap a box.
    pub(in crate::spatial) fn overlapping(
        faces: &[Face],
        x: &[P3],
        low: [f32; 3],
        high: [f32; 3],
    ) -> Vec<u32> {
        let overlaps = |f: &Face| {
            (0..3).all(|d| {
                let along = f.map(|v| x[v as usize][d]);
                along.iter().any(|c| *c >= low[d]) && along.iter().any(|c| *c <= high[d])
            })
        };
        (0u32..)
            .zip(faces)
            .filter(|(_, f)| overlaps(f))
            .map(|(k, _)| k)
            .collect()
    }

    /// Points within `reach` of `p`, with their squared distances.
    pub(in crate::spatial) fn within(points: &[P3], p: &P3, reach: f32) -> Vec<(u32, f32)> {
        (0u32..)
            .zip(points)
            .map(|(i, q)| (i, (q - p).norm_squared()))
            .filter(|(_, d)| *d <= reach * reach)
            .collect()
    }

    /// Every edge against every triangle without a common corner: edges by their ends, and triangles.
    pub(in crate::spatial) fn intersections(faces: &[Face], x: &[V3d]) -> Vec<([u32; 2], u32)> {
        let mut found = Vec::new();
        for e in edges(faces) {
            for (n, f) in (0u32..).zip(faces) {
                let shared = f.iter().any(|v| e.contains(v));
                if !shared && passes_through(&e.map(|v| x[v as usize]), &f.map(|v| x[v as usize])) {
                    found.push((e, n));
                }
            }
        }
        found
    }
}
