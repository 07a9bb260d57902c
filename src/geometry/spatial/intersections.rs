//! Self-intersections of a moving triangle mesh: edges that pass through triangles without a common corner.

use super::Bvh;
use super::bvh::{Bounds, LEAF, NONE};
use super::triangle::passes_through;
use crate::math::{P3, V3d};
use crate::mesh::{Face, edge_faces};
use crate::par::{self, Par};

/// An edge that passes through a triangle of the same mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Intersection {
    /// Vertices of the edge, the smaller one first.
    pub edge: [u32; 2],
    /// Triangle.
    pub face: u32,
}

/// All pairs of an edge and a triangle without a common corner that pass through each other.
pub fn intersections(faces: &[Face], positions: &[P3]) -> Vec<Intersection> {
    let x: Vec<V3d> = positions.iter().map(|p| p.coords.cast()).collect();
    let mut finder = SelfIntersections::new(faces, &x);
    let found = finder.find(Par::Rayon, &x);
    found
        .iter()
        .map(|(e, face)| Intersection {
            edge: finder.edges[*e as usize],
            face: *face,
        })
        .collect()
}

/// Leaves that one thread queries in a row.
const CHUNK: usize = 32;

/// Self-intersection query of one mesh: a [`Bvh`] with the edges of each leaf.
#[derive(Clone, Debug)]
pub struct SelfIntersections {
    bvh: Bvh,
    edges: Vec<[u32; 2]>,
    edge_faces: Vec<[u32; 2]>,
    /// Edges whose first triangle is in each leaf.
    leaf_edges: Vec<Vec<u32>>,
}

impl SelfIntersections {
    /// Prepares triangles at `x` (metres); they may move freely afterwards.
    pub fn new(faces: &[Face], x: &[V3d]) -> Self {
        let (mut edges, mut beside) = (Vec::new(), Vec::new());
        for of_edge in edge_faces(faces).chunk_by(|a, b| a.0 == b.0) {
            let (first, others) = (of_edge[0].1, &of_edge[1..]);
            edges.push(of_edge[0].0);
            beside.push([first, others.last().map_or(NONE, |(_, f)| *f)]);
        }
        Self::with_edges(faces, edges, beside, x)
    }

    /// The triangles that `wanted` accepts as a mesh of their own, and the indices of its edges and triangles here.
    pub fn subset(&self, wanted: impl Fn(&Face) -> bool, x: &[V3d]) -> (Self, [Vec<u32>; 2]) {
        let all = self.faces();
        let of: Vec<u32> = (0..all.len() as u32)
            .filter(|f| wanted(&all[*f as usize]))
            .collect();
        let mut number = vec![NONE; all.len()];
        (0u32..).zip(&of).for_each(|(k, f)| number[*f as usize] = k);
        let (mut edges, mut edge_faces, mut numbers) = (Vec::new(), Vec::new(), Vec::new());
        for (k, (e, b)) in self.edges.iter().zip(&self.edge_faces).enumerate() {
            let [p, q] = b.map(|f| number.get(f as usize).copied().unwrap_or(NONE));
            if p.min(q) != NONE {
                edges.push(*e);
                edge_faces.push(if p == NONE { [q, p] } else { [p, q] });
                numbers.push(k as u32);
            }
        }
        let faces: Vec<Face> = of.iter().map(|f| all[*f as usize]).collect();
        (
            Self::with_edges(&faces, edges, edge_faces, x),
            [numbers, of],
        )
    }

    fn with_edges(
        faces: &[Face],
        edges: Vec<[u32; 2]>,
        edge_faces: Vec<[u32; 2]>,
        x: &[V3d],
    ) -> Self {
        let bvh = Bvh::new(faces, x);
        let mut leaf = vec![0; faces.len()];
        for (k, l) in bvh.leaves.iter().enumerate() {
            let real = l.faces.iter().filter(|f| **f != NONE);
            real.for_each(|f| leaf[*f as usize] = k);
        }
        let mut leaf_edges = vec![Vec::with_capacity(LEAF); bvh.leaves.len()];
        for (e, faces) in edge_faces.iter().enumerate() {
            leaf_edges[leaf[faces[0] as usize]].push(e as u32);
        }
        Self {
            bvh,
            edges,
            edge_faces,
            leaf_edges,
        }
    }

    /// Triangles.
    pub fn faces(&self) -> &[Face] {
        self.bvh.faces()
    }

    /// Edges by their vertices, the smaller one first, in ascending order.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// Triangles beside an edge: two, or one at a border.
    pub fn faces_beside(&self, edge: usize) -> impl Iterator<Item = u32> + use<> {
        self.edge_faces[edge].into_iter().filter(|f| *f != NONE)
    }

    /// Edge and triangle of each intersection at `x`, in ascending order.
    pub fn find(&mut self, par: Par, x: &[V3d]) -> Vec<(u32, u32)> {
        self.bvh.refit(x);
        let mut chunks: Vec<Vec<(u32, u32)>> = Vec::new();
        let count = self.leaf_edges.len().div_ceil(CHUNK);
        par::map_into(par, count, 1, &mut chunks, |c| {
            let (mut found, mut edges) = (Vec::new(), Vec::new());
            let end = ((c + 1) * CHUNK).min(self.leaf_edges.len());
            for leaf in &self.leaf_edges[c * CHUNK..end] {
                edges.clear();
                edges.extend(leaf.iter().map(|e| (self.edge_bounds(*e, x), *e)));
                self.find_near(&edges, x, &mut found);
            }
            found
        });
        let mut found = chunks.concat();
        // The order must not depend on the tree.
        found.sort_unstable();
        found
    }

    fn edge_bounds(&self, e: u32, x: &[V3d]) -> Bounds {
        Bounds::of(self.edges[e as usize].map(|v| x[v as usize]))
    }

    /// Intersections of edges that lie together: one traversal of the tree for all of them.
    fn find_near(&self, edges: &[(Bounds, u32)], x: &[V3d], found: &mut Vec<(u32, u32)>) {
        let mut all = Bounds::EMPTY;
        edges.iter().for_each(|(b, _)| all.include(b));
        self.bvh.overlapping_leaves(&all, |bounds, leaf| {
            for (b, e) in edges.iter().filter(|(b, _)| !bounds.is_apart(b)) {
                for f in self.bvh.leaves[leaf as usize].overlapping(b) {
                    let (edge, corners) = (self.edges[*e as usize], self.faces()[f as usize]);
                    let shared = corners.iter().any(|v| edge.contains(v));
                    let at = |v: u32| x[v as usize];
                    if !shared && passes_through(&edge.map(at), &corners.map(at)) {
                        found.push((*e, f));
                    }
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spatial::brute;
    use rand::{Rng, SeedableRng};

    #[test]
    fn needle_through_a_triangle_intersects_and_one_beside_it_does_not() {
        let faces = [[0, 1, 2], [3, 4, 5]];
        let at = |x: f32| {
            let two = [
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [x, 0.2, -1.0],
                [x, 0.2, 1.0],
                [9.0, 0.2, 0.0],
            ];
            intersections(&faces, &two.map(P3::from))
        };
        // Both long edges of the needle pass through, and at 0.2 so does one side of the triangle through the needle's.
        assert!(at(0.2).contains(&Intersection {
            edge: [3, 4],
            face: 0
        }));
        assert_eq!(at(1.2), []);
        assert_eq!(intersections(&faces[..1], &[P3::origin(); 3]), []);
    }

    #[test]
    fn infinite_coordinates_do_not_panic() {
        let far = |by: f32| {
            [
                [-by; 3],
                [by; 3],
                [0.0, 0.0, 1.0],
                [0.1, 0.0, 0.0],
                [0.2, 0.1, 0.0],
                [0.1, 0.2, 0.1],
            ]
        };
        for by in [f32::INFINITY, f32::MAX] {
            intersections(&[[0, 1, 2], [3, 4, 5]], &far(by).map(P3::from));
        }
    }

    #[test]
    fn find_agrees_with_brute_force_after_the_mesh_has_moved() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        for (n, spread, size) in [
            (0, 1.0, 0.1),
            (1, 1.0, 0.1),
            (5, 0.1, 0.2),
            (300, 1.0, 0.3),
            (300, 0.0, 0.2),
        ] {
            let mut points = |n: usize| -> Vec<P3> {
                let mut out = Vec::new();
                for _ in 0..n {
                    let mut p =
                        || std::array::from_fn::<f32, 3, _>(|_| random.random::<f32>() - 0.5);
                    let middle = p().map(|c| c * spread);
                    for _ in 0..3 {
                        let c = p();
                        out.push(P3::from(std::array::from_fn::<f32, 3, _>(|k| {
                            middle[k] + c[k] * size
                        })));
                    }
                }
                out
            };
            // Some have a corner in common with the next one.
            let faces: Vec<Face> = (0..n as u32)
                .map(|k| {
                    [
                        3 * k,
                        3 * k + 1,
                        if k % 3 == 0 {
                            (3 * k + 3) % (3 * n as u32)
                        } else {
                            3 * k + 2
                        },
                    ]
                })
                .collect();
            let first = points(n);
            let double = |p: &[P3]| -> Vec<V3d> { p.iter().map(|p| p.coords.cast()).collect() };
            let mut finder = SelfIntersections::new(&faces, &double(&first));
            for mut x in [first, points(n)] {
                for broken in [false, true] {
                    if broken && n > 2 {
                        x[4].x = f32::NAN;
                        x[7].y = f32::INFINITY;
                    }
                    let x = double(&x);
                    let found = finder.find(Par::Rayon, &x);
                    let fast: Vec<([u32; 2], u32)> = found
                        .iter()
                        .map(|(e, f)| (finder.edges[*e as usize], *f))
                        .collect();
                    let slow = brute::intersections(&faces, &x);
                    assert!(n < 300 || broken || slow.len() > 100, "{}", slow.len());
                    assert_eq!(fast, slow, "{n}");
                }
            }
        }
    }

    #[test]
    fn subset_finds_what_the_whole_mesh_finds_there() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        let x: Vec<V3d> = (0..300)
            .map(|_| V3d::new(random.random(), random.random(), random.random()))
            .collect();
        let faces: Vec<Face> = (0..299u32).map(|k| [k, k + 1, (7 * k) % 300]).collect();
        let mut whole = SelfIntersections::new(&faces, &x);
        let all = whole.find(Par::Seq, &x);
        let wanted = |f: &Face| f[0] < 120;
        let (mut part, [edges, of]) = whole.subset(wanted, &x);
        let found: Vec<(u32, u32)> = part
            .find(Par::Seq, &x)
            .into_iter()
            .map(|(e, f)| (edges[e as usize], of[f as usize]))
            .collect();
        let inside = |(e, f): &&(u32, u32)| {
            wanted(&faces[*f as usize])
                && whole
                    .faces_beside(*e as usize)
                    .any(|f| wanted(&faces[f as usize]))
        };
        assert_eq!(
            found,
            all.iter().filter(inside).copied().collect::<Vec<_>>()
        );
        assert!(!found.is_empty() && found.len() < all.len());
    }
}
