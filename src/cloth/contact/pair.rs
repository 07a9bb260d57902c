//! Contact pairs: two features by the indices of their vertices, in one array of cloth and then obstacle vertices.

use super::distance::{
    ClosestFeatures, Separation, edge_edge, mollifier_threshold, point_edge, point_point,
    point_triangle,
};
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
    /// A vertex and an edge.
    VertexEdge {
        /// Vertex.
        v: u32,
        /// Ends of the edge.
        e: [u32; 2],
    },
    /// Two vertices.
    VertexVertex {
        /// Vertices.
        v: [u32; 2],
    },
}

impl ContactPair {
    /// Vertices of the stencil; smaller pairs repeat their last vertex, whose weight and derivatives are zero there.
    #[inline]
    pub fn stencil(&self) -> [u32; 4] {
        match *self {
            Self::VertexFace { v, f } => [v, f[0], f[1], f[2]],
            Self::EdgeEdge { a, b } => [a[0], a[1], b[0], b[1]],
            Self::VertexEdge { v, e } => [v, e[0], e[1], e[1]],
            Self::VertexVertex { v } => [v[0], v[1], v[1], v[1]],
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
            Self::VertexEdge { .. } => point_edge(p, q, r).embed([0, 1, 2]),
            Self::VertexVertex { .. } => point_point(p, q).embed([0, 1]),
        }
    }
    /// Lower bound of the squared distance (m²): that of the two features' boxes. Cheap, to leave far pairs out.
    #[inline]
    pub fn box_gap_squared(&self, [p, q, r, s]: &[V3d; 4]) -> f64 {
        let [(low_a, high_a), (low_b, high_b)] = match self {
            Self::EdgeEdge { .. } => [(p.inf(q), p.sup(q)), (r.inf(s), r.sup(s))],
            _ => [(*p, *p), (q.inf(r).inf(s), q.sup(r).sup(s))],
        };
        let gap = (low_a - high_b).sup(&(low_b - high_a));
        gap.map(|g| g.max(0.0)).norm_squared()
    }
    /// Pair of the features that hold the closest points, its vertices in ascending order within a feature.
    pub fn reduced(&self, features: ClosestFeatures) -> Self {
        let stencil = self.stencil();
        let [mut a, mut b] = match features {
            ClosestFeatures::VertexVertex(p, q) => {
                let [p, q] = [p, q].map(|k| stencil[usize::from(k)]);
                return Self::VertexVertex {
                    v: [p.min(q), p.max(q)],
                };
            }
            ClosestFeatures::VertexEdge(v, edge) => {
                let [p, q] = edge.map(|k| stencil[usize::from(k)]);
                return Self::VertexEdge {
                    v: stencil[usize::from(v)],
                    e: [p.min(q), p.max(q)],
                };
            }
            ClosestFeatures::VertexFace => return *self,
            ClosestFeatures::EdgeEdge => [[stencil[0], stencil[1]], [stencil[2], stencil[3]]],
        };
        a.sort_unstable();
        b.sort_unstable();
        Self::EdgeEdge {
            a: a.min(b),
            b: a.max(b),
        }
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
            _ => 0.0,
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
            pair: ContactPair::VertexVertex { v: [0; 2] },
            weight: 0.0,
            parallel_threshold: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn positions() -> Vec<V3d> {
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
            .map(V3d::from)
            .to_vec()
    }

    #[test]
    fn reduced_pairs_have_the_same_separation() {
        let mut x = positions();
        for p in [
            [0.2, 0.3, 0.1],
            [0.4, -0.3, 0.1],
            [-0.3, -0.2, 0.1],
            [0.9, 0.8, 0.0],
        ] {
            x.truncate(3);
            x.push(V3d::from(p));
            let pair = ContactPair::VertexFace { v: 3, f: [2, 1, 0] };
            let whole = pair.separation(&pair.corners(&x));
            let reduced = pair.reduced(whole.features);
            let part = reduced.separation(&reduced.corners(&x));
            assert!((whole.squared - part.squared).abs() < 1e-15, "{reduced:?}");
        }
        let pair = ContactPair::EdgeEdge {
            a: [3, 2],
            b: [1, 0],
        };
        let sorted = ContactPair::EdgeEdge {
            a: [0, 1],
            b: [2, 3],
        };
        assert_eq!(pair.reduced(ClosestFeatures::EdgeEdge), sorted);
        let ends = ClosestFeatures::VertexVertex(1, 3);
        assert_eq!(pair.reduced(ends), ContactPair::VertexVertex { v: [0, 2] });
    }

    #[test]
    fn smaller_pairs_have_zero_weights_at_repeated_vertices() {
        let x = positions();
        let pair = ContactPair::VertexEdge { v: 2, e: [0, 1] };
        let near = pair.separation(&pair.corners(&x));
        assert_eq!((pair.stencil(), near.weights[3]), ([2, 0, 1, 1], 0.0));
        let two = ContactPair::VertexVertex { v: [1, 2] };
        let far = two.separation(&two.corners(&x));
        assert_eq!(far.weights.as_slice(), [1.0, -1.0, 0.0, 0.0]);
        assert!((far.squared - 2.0).abs() < 1e-15);
    }
}
