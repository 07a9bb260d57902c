//! Linear motion of a vertex–face or edge–edge pair, as a convex polygon of differences that moves past the origin.
//!
//! The pair touches where the Minkowski difference of its two simplices contains the origin: a triangle for
//! vertex–face, a parallelogram for edge–edge. Its corners move linearly. The subtraction also removes the offset of
//! the pair from the origin of the frame, with one rounding a component.

use super::arithmetic::{Arithmetic, UNIT, Vector, difference, magnitudes, map2, mix};
use crate::contact::pair::ContactPair;
use tryon_geometry::math::V3d;

/// Kind of a pair whose impact has codimension one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PairKind {
    /// Points: vertex, then three corners of the face.
    VertexFace,
    /// Points: two ends of the first edge, then two of the second.
    EdgeEdge,
}

/// Motion of the four points of a pair along straight lines over the time [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairMotion {
    /// Order of the points.
    pub kind: PairKind,
    /// Positions at time 0, metres.
    pub start: [V3d; 4],
    /// Positions at time 1, metres.
    pub end: [V3d; 4],
}

impl PairMotion {
    /// Motion of a contact pair.
    ///
    /// # Panics
    /// With fewer positions than the pair's indices need.
    pub fn of(pair: &ContactPair, start: &[V3d], end: &[V3d]) -> Self {
        let kind = match pair {
            ContactPair::EdgeEdge { .. } => PairKind::EdgeEdge,
            ContactPair::VertexFace { .. } => PairKind::VertexFace,
        };
        Self {
            kind,
            start: pair.corners(start),
            end: pair.corners(end),
        }
    }

    /// Largest error of a distance of its points after the motion was scaled and rounded, metres.
    ///
    /// `x + t (y - x)` has an error of 3 u |x| a component, u the unit roundoff; a difference twice that.
    pub(super) fn scaling_error(&self) -> f64 {
        let points = self.start.iter().chain(&self.end);
        16.0 * UNIT * points.fold(0.0, |m: f64, p| m.max(p.amax()))
    }

    /// The polygon of differences.
    pub(super) fn polygon<S: Arithmetic>(&self) -> MovingPolygon<S> {
        MovingPolygon {
            start: corners(self.kind, &self.start),
            end: corners(self.kind, &self.end),
        }
    }

    /// Two sides of the polygon and one corner at the start and at the end.
    pub(super) fn frames<S: Arithmetic>(&self) -> [[Vector<S>; 3]; 2] {
        [frame(self.kind, &self.start), frame(self.kind, &self.end)]
    }
}

#[inline]
fn between<S: Arithmetic>(a: &V3d, b: &V3d) -> Vector<S> {
    std::array::from_fn(|c| S::of(a[c]) - S::of(b[c]))
}

/// Corners of the polygon in cyclic order; a triangle repeats its last one.
fn corners<S: Arithmetic>(kind: PairKind, [p, q, r, s]: &[V3d; 4]) -> [Vector<S>; 4] {
    match kind {
        PairKind::VertexFace => {
            let last = between(p, s);
            [between(p, q), between(p, r), last, last]
        }
        PairKind::EdgeEdge => [between(p, r), between(p, s), between(q, s), between(q, r)],
    }
}

fn frame<S: Arithmetic>(kind: PairKind, [p, q, r, s]: &[V3d; 4]) -> [Vector<S>; 3] {
    match kind {
        PairKind::VertexFace => [between(r, q), between(s, q), between(p, q)],
        PairKind::EdgeEdge => [between(q, p), between(s, r), between(p, r)],
    }
}

/// Convex planar polygon whose corners move linearly over [0, 1].
#[derive(Clone, Copy, Debug)]
pub(super) struct MovingPolygon<S> {
    pub(super) start: [Vector<S>; 4],
    pub(super) end: [Vector<S>; 4],
}

impl<S: Arithmetic> MovingPolygon<S> {
    /// Largest magnitude of each component, metres.
    pub(super) fn extent(&self) -> V3d {
        let all = self.start.iter().chain(&self.end);
        all.fold(V3d::zeros(), |m, p| m.sup(&magnitudes(p)))
    }

    /// Corners at time `t`, rounded.
    pub(super) fn at(&self, t: S) -> [Vector<S>; 4] {
        std::array::from_fn(|i| map2(&self.start[i], &self.end[i], |a, b| mix(a, b, t)))
    }
}

/// Side from corner `i` to the next one.
#[inline]
pub(super) fn side<S: Arithmetic>(corners: &[Vector<S>; 4], i: usize) -> Vector<S> {
    difference(&corners[(i + 1) % 4], &corners[i])
}
