//! Where a sheet passes through itself: the judge of self-collision.

use crate::math::{P3, V3d};
use crate::mesh::Face;

/// An edge that passes through a triangle of the same sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossing {
    /// Vertices of the edge.
    pub edge: [u32; 2],
    /// Number of the triangle.
    pub face: u32,
}

/// Pairs of an edge and a triangle without a common corner that pass through each other.
pub fn crossings(faces: &[Face], positions: &[P3]) -> Vec<Crossing> {
    let x: Vec<V3d> = positions.iter().map(|p| p.coords.cast()).collect();
    let corners = |f: &Face| f.map(|v| x[v as usize]);
    let mut edges: Vec<[u32; 2]> =
        faces.iter().flat_map(|f| [(0, 1), (1, 2), (2, 0)].map(|(i, j)| [f[i].min(f[j]), f[i].max(f[j])])).collect();
    edges.sort_unstable();
    edges.dedup();
    // Along one axis in order, so that each edge sees only what lies beside it.
    let low = |all: &[V3d]| all.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
    let high = |all: &[V3d]| all.iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max);
    let mut sorted: Vec<(f64, f64, usize)> =
        faces.iter().enumerate().map(|(n, f)| (low(&corners(f)), high(&corners(f)), n)).collect();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let widest = sorted.iter().map(|s| s.1 - s.0).fold(0.0, f64::max);
    let mut found = Vec::new();
    for e in &edges {
        let ends = e.map(|v| x[v as usize]);
        let from = sorted.partition_point(|s| s.0 < low(&ends) - widest);
        for (_, _, n) in sorted[from..].iter().take_while(|s| s.0 <= high(&ends)).filter(|s| s.1 >= low(&ends)) {
            let f = &faces[*n];
            if !f.iter().any(|v| e.contains(v)) && passes(&ends, &corners(f)) {
                found.push(Crossing { edge: *e, face: *n as u32 });
            }
        }
    }
    found
}

/// A segment passes through a triangle: its ends lie on both sides, and it turns the same way around all three sides.
fn passes([p, q]: &[V3d; 2], [a, b, c]: &[V3d; 3]) -> bool {
    let volume = |a: &V3d, b: &V3d, c: &V3d, d: &V3d| (b - a).cross(&(c - a)).dot(&(d - a));
    let (from, to) = (volume(a, b, c, p), volume(a, b, c, q));
    let around = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    from * to < 0.0 && (around.iter().all(|v| *v > 0.0) || around.iter().all(|v| *v < 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_needle_through_a_triangle_is_seen_and_one_beside_it_is_not() {
        let faces = [[0, 1, 2], [3, 4, 5]];
        let at = |x: f32| {
            let two =
                [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [x, 0.2, -1.0], [x, 0.2, 1.0], [9.0, 0.2, 0.0]];
            crossings(&faces, &two.map(P3::from))
        };
        // Both long edges of the needle pass through, and at 0.2 so does one side of the triangle through the needle's.
        assert!(at(0.2).contains(&Crossing { edge: [3, 4], face: 0 }));
        assert_eq!(at(1.2), []);
        assert_eq!(crossings(&faces[..1], &[P3::origin(); 3]), []);
    }
}
