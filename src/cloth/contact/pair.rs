//! Contact pairs: two features by the indices of their vertices, in one array of cloth and then obstacle vertices.

use super::distance::{Separation, edge_edge, mollifier_threshold, point_triangle};
use tryon_geometry::math::V3d;

/// Two features of a surface in contact. Vertex indices point into one array, obstacle vertices after those of cloth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ContactPair {
    /// A vertex and a triangle.
    VertexFace {
        /// Vertex.
        v: u32,
        /// Corners of the triangle.
        f: [u32; 3],
    },
    /// Two edges.
    EdgeEdge {
        /// Ends of the first edge.
        a: [u32; 2],
        /// Ends of the second edge.
        b: [u32; 2],
    },
}

impl ContactPair {
    /// Vertices of the stencil.
    #[inline]
    pub fn stencil(&self) -> [u32; 4] {
        match *self {
            Self::VertexFace { v, f } => [v, f[0], f[1], f[2]],
            Self::EdgeEdge { a, b } => [a[0], a[1], b[0], b[1]],
        }
    }
    /// Positions of the stencil (m) out of those of all vertices.
    ///
    /// # Panics
    /// With fewer positions than the pair's indices need.
    #[inline]
    pub fn corners(&self, positions: &[V3d]) -> [V3d; 4] {
        self.stencil().map(|v| positions[v as usize])
    }
    /// Closest points of the two features with these [`Self::corners`].
    #[inline]
    pub fn separation(&self, [p, q, r, s]: &[V3d; 4]) -> Separation<4> {
        match self {
            Self::VertexFace { .. } => point_triangle(p, [q, r, s]),
            Self::EdgeEdge { .. } => edge_edge([p, q], [r, s]),
        }
    }
    /// Lower bound of the squared distance (m²): that of the two features' boxes. Cheap, to leave far pairs out.
    #[inline]
    pub fn box_gap_squared(&self, [p, q, r, s]: &[V3d; 4]) -> f64 {
        let [(low_a, high_a), (low_b, high_b)] = match self {
            Self::EdgeEdge { .. } => [(p.inf(q), p.sup(q)), (r.inf(s), r.sup(s))],
            Self::VertexFace { .. } => [(*p, *p), (q.inf(r).inf(s), q.sup(r).sup(s))],
        };
        let gap = (low_a - high_b).sup(&(low_b - high_a));
        gap.map(|g| g.max(0.0)).norm_squared()
    }
}

/// Pair that a potential acts on, with what does not change over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActivePair {
    /// Features.
    pub pair: ContactPair,
    /// Factor of the energy: area of the contact over a reference area, or 1.
    pub weight: f64,
    /// ε of the mollifier of parallel edges (m⁴); zero switches it off.
    pub parallel_threshold: f64,
}

impl ActivePair {
    /// Pair of weight 1; the edges of an edge pair are mollified by their lengths in `rest` (m): positions at rest, or
    /// at the start of the step.
    pub fn new(pair: ContactPair, rest: &[V3d]) -> Self {
        let parallel_threshold = match pair {
            ContactPair::EdgeEdge { .. } => {
                let [a0, a1, b0, b1] = pair.corners(rest);
                mollifier_threshold(&(a1 - a0), &(b1 - b0))
            }
            ContactPair::VertexFace { .. } => 0.0,
        };
        Self {
            pair,
            weight: 1.0,
            parallel_threshold,
        }
    }
}

impl Default for ActivePair {
    /// Fills a buffer before pairs are known.
    fn default() -> Self {
        Self {
            pair: ContactPair::VertexFace { v: 0, f: [0; 3] },
            weight: 0.0,
            parallel_threshold: 0.0,
        }
    }
}
