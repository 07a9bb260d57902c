//! Exact test of a segment against a closed triangle: signs of orientation determinants in adaptive precision
//! (Shewchuk 1997). Touching counts; degenerate segments and triangles are the point sets that they are.

use robust::{Coord, Coord3D, orient2d, orient3d};
use tryon_geometry::math::V3d;

/// True if the closed segment and the closed triangle have a point in common.
pub(crate) fn edge_meets_triangle([p, q]: &[V3d; 2], [a, b, c]: &[V3d; 3]) -> bool {
    let [above, below] = [side(a, b, c, p), side(a, b, c, q)];
    if above * below > 0 {
        return false;
    }
    let around = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    if above == 0 && below == 0 {
        // In one plane, if the sides of a degenerate triangle agree.
        return around == [0; 3] && (0..3).all(|axis| overlap_along(axis, &[p, q], &[a, b, c]));
    }
    // The line through the edge passes the sides in one sense.
    around.iter().all(|s| *s >= 0) || around.iter().all(|s| *s <= 0)
}

fn sign(value: f64) -> i8 {
    i8::from(value > 0.0) - i8::from(value < 0.0)
}

fn side(a: &V3d, b: &V3d, c: &V3d, d: &V3d) -> i8 {
    let point = |v: &V3d| Coord3D {
        x: v.x,
        y: v.y,
        z: v.z,
    };
    sign(orient3d(point(a), point(b), point(c), point(d)))
}

/// Overlap of the projections along an axis.
fn overlap_along(axis: usize, segment: &[&V3d; 2], triangle: &[&V3d; 3]) -> bool {
    let flat = |v: &V3d| Coord {
        x: v[(axis + 1) % 3],
        y: v[(axis + 2) % 3],
    };
    let [p, q] = segment.map(flat);
    let [a, b, c] = triangle.map(flat);
    let turn = |a, b, c| sign(orient2d(a, b, c));
    let turns = [turn(a, b, p), turn(b, c, p), turn(c, a, p)];
    let area = turn(a, b, c);
    let is_inside = area != 0 && turns.iter().all(|t| t * area >= 0);
    is_inside
        || [[a, b], [b, c], [c, a]]
            .iter()
            .any(|side| segments_meet([p, q], *side))
}

/// Closed segments in the plane.
fn segments_meet([p, q]: [Coord<f64>; 2], [a, b]: [Coord<f64>; 2]) -> bool {
    let turn = |a, b, c| sign(orient2d(a, b, c));
    let crosses = turn(p, q, a) * turn(p, q, b) <= 0 && turn(a, b, p) * turn(a, b, q) <= 0;
    // Collinear segments meet if their boxes do.
    let boxes_meet = |p: f64, q: f64, a: f64, b: f64| p.max(q) >= a.min(b) && a.max(b) >= p.min(q);
    crosses && boxes_meet(p.x, q.x, a.x, b.x) && boxes_meet(p.y, q.y, a.y, b.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    fn meets(edge: [[f64; 3]; 2], triangle: [[f64; 3]; 3]) -> bool {
        let (edge, triangle) = (edge.map(V3d::from), triangle.map(V3d::from));
        let all: Vec<bool> = (0..3)
            .flat_map(|k| {
                let [a, b, c] = [0, 1, 2].map(|i| triangle[(i + k) % 3]);
                let [p, q] = edge;
                [[p, q], [q, p]].map(|e| {
                    [
                        edge_meets_triangle(&e, &[a, b, c]),
                        edge_meets_triangle(&e, &[a, c, b]),
                    ]
                })
            })
            .flatten()
            .collect();
        assert!(all.iter().all(|m| *m == all[0]), "depends on the order");
        all[0]
    }

    #[test]
    fn crossing_touching_and_missing_edges() {
        let at = |x: f64, y: f64, low: f64, high: f64| [[x, y, low], [x, y, high]];
        assert!(meets(at(0.2, 0.2, -1.0, 1.0), TRIANGLE));
        assert!(meets(at(0.2, 0.2, 0.0, 1.0), TRIANGLE));
        assert!(meets(at(0.5, 0.5, -1.0, 1.0), TRIANGLE));
        assert!(meets(at(1.0, 0.0, -1.0, 1.0), TRIANGLE));
        assert!(!meets(at(0.2, 0.2, f64::EPSILON, 1.0), TRIANGLE));
        assert!(!meets(at(0.5, 0.5 + f64::EPSILON, -1.0, 1.0), TRIANGLE));
        assert!(!meets(at(-1e-300, 0.5, -1.0, 1.0), TRIANGLE));
    }

    #[test]
    fn coplanar_edges_meet_where_they_overlap() {
        assert!(meets([[0.1, 0.1, 0.0], [0.2, 0.2, 0.0]], TRIANGLE));
        assert!(meets([[-1.0, 0.2, 0.0], [2.0, 0.2, 0.0]], TRIANGLE));
        assert!(meets([[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]], TRIANGLE));
        assert!(!meets([[-1.0, 0.0, 0.0], [-0.1, 0.0, 0.0]], TRIANGLE));
        assert!(!meets([[0.6, 0.6, 0.0], [2.0, 2.0, 0.0]], TRIANGLE));
    }

    #[test]
    fn degenerate_shapes_are_their_point_sets() {
        let needle = [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]];
        assert!(meets([[0.5, 0.5, -1.0], [0.5, 0.5, 2.0]], needle));
        assert!(!meets([[0.5, 0.4, -1.0], [0.5, 0.4, 2.0]], needle));
        assert!(meets([[0.2, 0.2, 0.0]; 2], TRIANGLE));
        assert!(!meets([[0.2, 0.2, 1e-300]; 2], TRIANGLE));
        assert!(meets([[0.5; 3]; 2], [[0.5; 3]; 3]));
        assert!(!meets([[0.5; 3]; 2], [[0.4; 3]; 3]));
    }
}
