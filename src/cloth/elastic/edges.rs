//! Interior edges of a mesh with the rest geometry of both wings.

use super::{Dihedral, RestTriangle};
use nalgebra::Vector2;
use std::collections::{BTreeMap, BTreeSet};
use tryon_geometry::math::V3d;

/// Edge with a face on each side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct InteriorEdge {
    /// Edge start, edge end, left apex, right apex.
    pub(super) corners: [u32; 4],
    /// Left and right face.
    pub(super) faces: [u32; 2],
    /// Number of the corner opposite the edge in each face.
    pub(super) opposite: [usize; 2],
}

/// Rest triangle seen from one of its edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RestWing {
    /// Edge length (m).
    pub(super) length: f64,
    /// Area (m²).
    pub(super) area: f64,
    /// Unit normal of the edge in the material.
    pub(super) normal: Vector2<f64>,
    /// Apex along the edge from its start, and away from it (m).
    pub(super) apex: Vector2<f64>,
}

impl InteriorEdge {
    /// Both wings at rest.
    pub(super) fn wings(&self, triangles: &[RestTriangle]) -> [RestWing; 2] {
        [0, 1].map(|side| {
            let t = &triangles[self.faces[side] as usize];
            let k = self.opposite[side];
            // The left face traverses the edge from its start, the right one from its end.
            let [start, end] = [[1, 2], [2, 1]][side].map(|j| t.corners[(k + j) % 3]);
            let (edge, arm) = (end - start, t.corners[k] - start);
            let length = edge.norm();
            RestWing {
                length,
                area: t.area,
                normal: Vector2::new(edge.y, -edge.x) / length,
                apex: Vector2::new(edge.dot(&arm), edge.perp(&arm).abs()) / length,
            }
        })
    }
    /// Dihedral angle (rad) in a folded rest shape, zero without one.
    pub(super) fn rest_angle(&self, folded: Option<&[V3d]>) -> f64 {
        folded.map_or(0.0, |x| {
            Dihedral::angle(&self.corners.map(|v| x[v as usize]))
        })
    }
}

/// Face and its corner opposite an edge, of the face that traverses it from its smaller vertex and of the other.
type Sides = [Option<(u32, usize)>; 2];

/// Edges with two faces that are oriented alike, sorted by their vertices. A seam of three or more panels is no hinge.
pub(super) fn interior_edges(faces: &[[u32; 3]]) -> Vec<InteriorEdge> {
    let mut sides: BTreeMap<[u32; 2], Sides> = BTreeMap::new();
    let mut seams = BTreeSet::new();
    for (face, f) in faces.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (f[(k + 1) % 3], f[(k + 2) % 3]);
            let side = &mut sides.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)];
            if side.replace((face as u32, k)).is_some() {
                seams.insert([a.min(b), a.max(b)]);
            }
        }
    }
    let edge = |(v, side): (&[u32; 2], &Sides)| {
        let [(left, k), (right, m)] = [side[0]?, side[1]?];
        let apex = |face: u32, k: usize| faces[face as usize][k];
        Some(InteriorEdge {
            corners: [v[0], v[1], apex(left, k), apex(right, m)],
            faces: [left, right],
            opposite: [k, m],
        })
    };
    let others = sides.iter().filter(|(v, _)| !seams.contains(*v));
    others.filter_map(edge).collect()
}
