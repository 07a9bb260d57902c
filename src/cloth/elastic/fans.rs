//! Fans of triangles around vertices, laid out flat.

use super::RestTriangle;
use super::edges::InteriorEdge;
use nalgebra::{Matrix2, Vector2, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Spokes from which a quadratic height is known: with the centre they have six points.
const ENOUGH: usize = 5;

/// Hinge as one fan sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FanHinge {
    /// Number of the interior edge.
    pub(super) edge: u32,
    /// Angle by the curvature (κᵤᵤ, κᵥᵥ, 2 κᵤᵥ) of a quadratic height (m).
    pub(super) by_curvature: Vector3<f64>,
    /// Edge length times its unit curvature n ⊗ n (uu, vv, 2 uv) (m).
    pub(super) measure: Vector3<f64>,
    /// Ends at the fan's centre.
    pub(super) is_spoke: bool,
}

/// Faces around a vertex, from edge to edge.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Fan {
    /// A third of the faces' area (m²).
    pub(super) area: f64,
    /// Spokes; at a boundary and where they are few also the edges opposite the centre.
    pub(super) hinges: Vec<FanHinge>,
}

/// Mesh at rest with its interior edges.
pub(super) struct RestMesh<'a> {
    pub(super) faces: &'a [[u32; 3]],
    pub(super) triangles: &'a [RestTriangle],
    pub(super) edges: &'a [InteriorEdge],
    /// Number of the interior edge opposite each corner, shape `[faces]`.
    sides: Vec<[Option<u32>; 3]>,
}

impl<'a> RestMesh<'a> {
    pub(super) fn new(
        faces: &'a [[u32; 3]],
        triangles: &'a [RestTriangle],
        edges: &'a [InteriorEdge],
    ) -> Self {
        let mut sides = vec![[None; 3]; faces.len()];
        for (number, edge) in edges.iter().enumerate() {
            for side in 0..2 {
                sides[edge.faces[side] as usize][edge.opposite[side]] = Some(number as u32);
            }
        }
        Self {
            faces,
            triangles,
            edges,
            sides,
        }
    }
    /// All fans; a vertex at which surfaces touch in a point has several.
    pub(super) fn fans(&self) -> Vec<Fan> {
        let mut corners: BTreeMap<u32, Vec<(usize, usize)>> = BTreeMap::new();
        for (face, f) in self.faces.iter().enumerate() {
            for k in 0..3 {
                corners.entry(f[k]).or_default().push((face, k));
            }
        }
        let mut out = Vec::new();
        for mut around in corners.into_values() {
            while let Some(chain) = self.next_chain(&mut around) {
                out.push(self.fan(&chain));
            }
        }
        out
    }
    /// Takes one chain of neighbouring corners out of those around a vertex, counter-clockwise.
    fn next_chain(&self, around: &mut Vec<(usize, usize)>) -> Option<Vec<(usize, usize)>> {
        // A chain with a boundary starts at a corner whose first side has no neighbour.
        let start = around
            .iter()
            .position(|&(f, k)| self.sides[f][(k + 2) % 3].is_none())
            .unwrap_or(0);
        if around.is_empty() {
            return None;
        }
        let mut chain = vec![around.swap_remove(start)];
        while let Some(&(f, k)) = chain.last() {
            let side = self.sides[f][(k + 1) % 3];
            let next = around
                .iter()
                .position(|&(g, m)| side.is_some() && self.sides[g][(m + 2) % 3] == side);
            match next {
                Some(next) => chain.push(around.swap_remove(next)),
                None => break,
            }
        }
        Some(chain)
    }
    /// Lays out a chain of corners.
    fn fan(&self, chain: &[(usize, usize)]) -> Fan {
        let (Some(&(first, k)), Some(&(last, m))) = (chain.first(), chain.last()) else {
            return Fan::default();
        };
        let first_side = self.sides[first][(k + 2) % 3];
        let is_closed = first_side.is_some() && first_side == self.sides[last][(m + 1) % 3];
        let layout = Layout::new(self, chain, is_closed);
        let mut fan = Fan {
            area: chain
                .iter()
                .map(|&(f, _)| self.triangles[f].area)
                .sum::<f64>()
                / 3.0,
            hinges: Vec::new(),
        };
        let count = chain.len();
        let rim = |j: usize| layout.rim[if is_closed { j % count } else { j }];
        let spokes = if is_closed { count } else { count - 1 };
        for i in 0..spokes {
            // Between the corner i and the next.
            let (f, k) = chain[i];
            let Some(edge) = self.sides[f][(k + 1) % 3] else {
                continue;
            };
            let points = [Vector2::zeros(), rim(i + 1), rim(i + 2), rim(i)];
            fan.hinges.push(FanHinge::new(edge, points, true));
        }
        if count < ENOUGH || !is_closed {
            for (i, &(f, k)) in chain.iter().enumerate() {
                if let Some(edge) = self.sides[f][k] {
                    let (start, end) = (rim(i), rim(i + 1));
                    let outer = self.outer_apex(edge, f, start, end);
                    let points = [start, end, Vector2::zeros(), outer];
                    fan.hinges.push(FanHinge::new(edge, points, false));
                }
            }
        }
        for hinge in &mut fan.hinges {
            hinge.turn(layout.weft);
        }
        fan
    }
    /// Apex of the face across an edge of face `f`, which has the edge laid out from `start` to `end`.
    fn outer_apex(
        &self,
        edge: u32,
        f: usize,
        start: Vector2<f64>,
        end: Vector2<f64>,
    ) -> Vector2<f64> {
        let edge = &self.edges[edge as usize];
        let wings = edge.wings(self.triangles);
        let other = if edge.faces[0] as usize == f { 1 } else { 0 };
        let wing = &wings[other];
        let fraction = wing.apex.x / wing.length;
        let fraction = if other == 1 { fraction } else { 1.0 - fraction };
        let t = (end - start).normalize();
        start + (end - start) * fraction + Vector2::new(t.y, -t.x) * wing.apex.y
    }
}

/// Rim vertices of a fan around the origin, and the direction of the weft in that plane.
struct Layout {
    rim: Vec<Vector2<f64>>,
    weft: Vector2<f64>,
}

impl Layout {
    /// Corner angles are scaled to a full turn where the fan is closed.
    fn new(mesh: &RestMesh, chain: &[(usize, usize)], is_closed: bool) -> Self {
        let arms = |&(f, k): &(usize, usize)| {
            let c = &mesh.triangles[f].corners;
            [c[(k + 1) % 3] - c[k], c[(k + 2) % 3] - c[k]]
        };
        let angle = |[a, b]: [Vector2<f64>; 2]| a.perp(&b).abs().atan2(a.dot(&b));
        let total: f64 = chain.iter().map(|c| angle(arms(c))).sum();
        let scale = if is_closed { TAU / total } else { 1.0 };
        let (mut turned, mut rim) = (0.0f64, Vec::new());
        let mut weft = Vector2::zeros();
        for (i, corner) in chain.iter().enumerate() {
            let [a, b] = arms(corner);
            // A spoke has the mean length of its two sides.
            let before = chain[(i + chain.len() - 1) % chain.len()];
            let length = if i > 0 || is_closed {
                0.5 * (a.norm() + arms(&before)[1].norm())
            } else {
                a.norm()
            };
            let direction = Vector2::new(turned.cos(), turned.sin());
            rim.push(direction * length);
            // The weft is (1, 0) in the material, where this spoke is `a`.
            let mirrored = if a.perp(&b) < 0.0 { -1.0 } else { 1.0 };
            let (c, s) = (a.x / a.norm(), -a.y / a.norm() * mirrored);
            let here = Vector2::new(
                direction.x * c - direction.y * s,
                direction.x * s + direction.y * c,
            );
            weft += here * mesh.triangles[corner.0].area;
            turned += angle([a, b]) * scale;
            if i + 1 == chain.len() && !is_closed {
                rim.push(Vector2::new(turned.cos(), turned.sin()) * b.norm());
            }
        }
        let weft = weft.try_normalize(f64::MIN_POSITIVE);
        Self {
            rim,
            weft: weft.unwrap_or_else(Vector2::x),
        }
    }
}

impl FanHinge {
    /// Hinge of (edge start, edge end, left apex, right apex) (m).
    fn new(edge: u32, points: [Vector2<f64>; 4], is_spoke: bool) -> Self {
        let [start, end, left, right] = points;
        let length = (end - start).norm();
        let t = (end - start) / length;
        let n = Vector2::new(t.y, -t.x);
        // Along the edge and away from it: left apex, right apex.
        let (s0, h0) = (t.dot(&(left - start)), -n.dot(&(left - start)));
        let (s1, h1) = (t.dot(&(right - start)), n.dot(&(right - start)));
        let along = 0.5 * (s1 * (s1 - length) / h1 + s0 * (s0 - length) / h0);
        let across = 0.5 * (h0 + h1);
        Self {
            edge,
            by_curvature: form(&t, &t, 0.5) * along
                + form(&t, &n, 0.5) * (s1 - s0)
                + form(&n, &n, 0.5) * across,
            measure: form(&n, &n, 1.0) * length,
            is_spoke,
        }
    }
    /// Turns the frame so that its first axis is `weft`.
    fn turn(&mut self, weft: Vector2<f64>) {
        let axes = Matrix2::from_columns(&[weft, Vector2::new(-weft.y, weft.x)]);
        let turned = |z: &Vector3<f64>, share: f64| {
            // Symmetric tensor with mixed component z₂ / (2 share).
            let mixed = z[2] / (2.0 * share);
            let m = axes.transpose() * Matrix2::new(z[0], mixed, mixed, z[1]) * axes;
            Vector3::new(m[(0, 0)], m[(1, 1)], m[(0, 1)] * 2.0 * share)
        };
        self.by_curvature = turned(&self.by_curvature, 0.5);
        self.measure = turned(&self.measure, 1.0);
    }
}

/// Components (uu, vv, and `share` times both mixed ones) of the symmetric part of a ⊗ b.
fn form(a: &Vector2<f64>, b: &Vector2<f64>, share: f64) -> Vector3<f64> {
    Vector3::new(a.x * b.x, a.y * b.y, share * (a.x * b.y + a.y * b.x))
}
