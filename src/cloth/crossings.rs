//! Where a sheet passes through itself: the judge of self-collision.

use crate::math::{P3, V3d};
use crate::mesh::Face;
use crate::par::{self, Par};
use wide::f32x8;

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
    let mut finder = Finder::new(faces, &x);
    let found = finder.find(Par::Rayon, &x);
    found
        .iter()
        .map(|(e, face)| Crossing {
            edge: finder.edges[*e as usize],
            face: *face,
        })
        .collect()
}

/// Triangles in a leaf of the tree, which are looked at together: as many numbers as a wide register holds.
const LEAF: usize = 8;
/// Leaves that one thread asks about in a row.
const CHUNK: usize = 32;
/// No second triangle lies beside a border, and none fills a leaf that has too few.
pub(crate) const NONE: u32 = u32::MAX;

/// A box around triangles. Inner nodes are followed by their first child; `skip` is the node after all below.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Single precision, rounded outwards; the fourth number is 0.
    low: [f32; 4],
    high: [f32; 4],
    skip: u32,
    /// Number of the leaf; [`NONE`] of inner nodes.
    leaf: u32,
}

/// Triangles that lie together.
#[derive(Clone, Debug)]
struct Leaf {
    faces: [u32; LEAF],
    /// Their lowest and highest corners, axis by axis.
    low: [[f32; LEAF]; 3],
    high: [[f32; LEAF]; 3],
    /// Edges of which they are the first triangle.
    edges: Vec<u32>,
}

/// Finds crossings of a sheet that moves: a tree of boxes, built once and fitted anew.
#[derive(Clone, Debug)]
pub(crate) struct Finder {
    pub(crate) faces: Vec<Face>,
    /// Ends, the smaller one first, in order.
    pub(crate) edges: Vec<[u32; 2]>,
    /// Triangles beside each edge, the second one [`NONE`] on borders.
    pub(crate) beside: Vec<[u32; 2]>,
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
}

impl Finder {
    /// For these triangles, which may move from `x` as they like; where they went far apart a search takes longer.
    pub(crate) fn new(faces: &[Face], x: &[V3d]) -> Self {
        let mut sides: Vec<([u32; 2], u32)> = faces
            .iter()
            .enumerate()
            .flat_map(|(n, f)| {
                [(0, 1), (1, 2), (2, 0)].map(|(i, j)| ([f[i].min(f[j]), f[i].max(f[j])], n as u32))
            })
            .collect();
        sides.sort_unstable();
        let (mut edges, mut beside): (Vec<[u32; 2]>, Vec<[u32; 2]>) = (Vec::new(), Vec::new());
        for (e, f) in sides {
            match beside.last_mut() {
                Some(b) if edges.last() == Some(&e) => b[1] = f,
                _ => {
                    edges.push(e);
                    beside.push([f, NONE]);
                }
            }
        }
        Self::with_tree(faces.to_vec(), edges, beside, x)
    }

    /// The triangles for which `wanted` says so, as a sheet of their own, and the numbers that its edges and triangles
    /// have in this one.
    pub(crate) fn piece(&self, wanted: impl Fn(&Face) -> bool, x: &[V3d]) -> (Self, [Vec<u32>; 2]) {
        let of: Vec<u32> = (0..self.faces.len() as u32)
            .filter(|f| wanted(&self.faces[*f as usize]))
            .collect();
        let mut number = vec![NONE; self.faces.len()];
        (0u32..).zip(&of).for_each(|(k, f)| number[*f as usize] = k);
        let (mut edges, mut beside, mut numbers) = (Vec::new(), Vec::new(), Vec::new());
        for (k, (e, b)) in self.edges.iter().zip(&self.beside).enumerate() {
            let [p, q] = b.map(|f| number.get(f as usize).copied().unwrap_or(NONE));
            if p.min(q) != NONE {
                edges.push(*e);
                beside.push(if p == NONE { [q, p] } else { [p, q] });
                numbers.push(k as u32);
            }
        }
        let faces = of.iter().map(|f| self.faces[*f as usize]).collect();
        (Self::with_tree(faces, edges, beside, x), [numbers, of])
    }

    fn with_tree(faces: Vec<Face>, edges: Vec<[u32; 2]>, beside: Vec<[u32; 2]>, x: &[V3d]) -> Self {
        let middles: Vec<V3d> = faces
            .iter()
            .map(|f| f.iter().map(|v| x[*v as usize]).sum())
            .collect();
        let mut new = Self {
            faces,
            edges,
            beside,
            nodes: Vec::new(),
            leaves: Vec::new(),
        };
        new.split(&middles, &mut (0..middles.len() as u32).collect::<Vec<_>>());
        let mut leaf = vec![0; middles.len()];
        for (k, l) in new.leaves.iter().enumerate() {
            l.faces
                .iter()
                .filter(|f| **f != NONE)
                .for_each(|f| leaf[*f as usize] = k);
        }
        for (e, faces) in new.beside.iter().enumerate() {
            new.leaves[leaf[faces[0] as usize]].edges.push(e as u32);
        }
        new
    }

    fn split(&mut self, middles: &[V3d], some: &mut [u32]) {
        let at = self.nodes.len();
        let leaf = if some.len() <= LEAF {
            self.leaves.len() as u32
        } else {
            NONE
        };
        self.nodes.push(Node {
            low: [0.0; 4],
            high: [0.0; 4],
            skip: 0,
            leaf,
        });
        if some.len() > LEAF {
            let (mut low, mut high) = (V3d::repeat(f64::INFINITY), V3d::repeat(f64::NEG_INFINITY));
            for f in some.iter() {
                low = low.inf(&middles[*f as usize]);
                high = high.sup(&middles[*f as usize]);
            }
            let axis = (high - low).imax();
            // Whole leaves on the left.
            let half = (some.len() / 2).next_multiple_of(LEAF);
            let by_axis = |f: &u32| middles[*f as usize][axis];
            some.select_nth_unstable_by(half - 1, |a, b| {
                by_axis(a).total_cmp(&by_axis(b)).then(a.cmp(b))
            });
            let (left, right) = some.split_at_mut(half);
            self.split(middles, left);
            self.split(middles, right);
        } else {
            let faces = std::array::from_fn(|l| some.get(l).copied().unwrap_or(NONE));
            // What no triangle fills meets nothing, not even a box without end.
            let nowhere = [[f32::NAN; LEAF]; 3];
            self.leaves.push(Leaf {
                faces,
                low: nowhere,
                high: nowhere,
                edges: Vec::new(),
            });
        }
        self.nodes[at].skip = self.nodes.len() as u32;
    }

    /// Fits the boxes to where the triangles are now.
    fn refit(&mut self, x: &[V3d]) {
        for k in (0..self.nodes.len()).rev() {
            let n = self.nodes[k];
            let (mut low, mut high) = ([f32::INFINITY; 4], [f32::NEG_INFINITY; 4]);
            let mut grow = |l: &[f32; 4], h: &[f32; 4]| {
                for c in 0..4 {
                    low[c] = low[c].min(l[c]);
                    high[c] = high[c].max(h[c]);
                }
            };
            if let Some(leaf) = self.leaves.get_mut(n.leaf as usize) {
                for l in 0..LEAF {
                    let Some(f) = self.faces.get(leaf.faces[l] as usize) else {
                        break;
                    };
                    let [a, b, c] = f.map(|v| x[v as usize]);
                    let (from, to) = (below(&a.inf(&b).inf(&c)), above(&a.sup(&b).sup(&c)));
                    grow(&from, &to);
                    (0..3).for_each(|d| (leaf.low[d][l], leaf.high[d][l]) = (from[d], to[d]));
                }
            } else {
                let second = self.nodes[k + 1].skip as usize;
                for child in [self.nodes[k + 1], self.nodes[second]] {
                    grow(&child.low, &child.high);
                }
            }
            (self.nodes[k].low, self.nodes[k].high) = (low, high);
        }
    }

    /// Numbers of the edge and the triangle of each crossing, in order.
    pub(crate) fn find(&mut self, par: Par, x: &[V3d]) -> Vec<(u32, u32)> {
        self.refit(x);
        let mut chunks: Vec<Vec<(u32, u32)>> = Vec::new();
        par::map_into(
            par,
            self.leaves.len().div_ceil(CHUNK),
            1,
            &mut chunks,
            |c| {
                let (mut found, mut edges) = (Vec::new(), Vec::new());
                for leaf in &self.leaves[c * CHUNK..((c + 1) * CHUNK).min(self.leaves.len())] {
                    edges.clear();
                    edges.extend(leaf.edges.iter().map(|e| (self.edge_box(*e, x), *e)));
                    self.of_edges(&edges, x, &mut found);
                }
                found
            },
        );
        let mut found = chunks.concat();
        // Whatever the tree.
        found.sort_unstable();
        found
    }

    fn edge_box(&self, e: u32, x: &[V3d]) -> [[f32; 4]; 2] {
        let [a, b] = self.edges[e as usize].map(|v| x[v as usize]);
        [below(&a.inf(&b)), above(&a.sup(&b))]
    }

    /// Crossings of edges near each other, with their boxes: the tree is gone through once for all of them.
    fn of_edges(&self, edges: &[([[f32; 4]; 2], u32)], x: &[V3d], found: &mut Vec<(u32, u32)>) {
        let (mut low, mut high) = ([f32::INFINITY; 4], [f32::NEG_INFINITY; 4]);
        for ([from, to], _) in edges {
            (0..4).for_each(|c| (low[c], high[c]) = (low[c].min(from[c]), high[c].max(to[c])));
        }
        let mut k = 0;
        while let Some(n) = self.nodes.get(k) {
            if apart(&n.low, &n.high, &low, &high) {
                k = n.skip as usize;
                continue;
            }
            k += 1;
            let Some(leaf) = self.leaves.get(n.leaf as usize) else {
                continue;
            };
            for (b, e) in edges
                .iter()
                .filter(|(b, _)| !apart(&n.low, &n.high, &b[0], &b[1]))
            {
                let mut near = leaf.meets(b);
                while near != 0 {
                    let f = leaf.faces[near.trailing_zeros() as usize];
                    near &= near - 1;
                    let (edge, corners) = (self.edges[*e as usize], self.faces[f as usize]);
                    let shared = corners.iter().any(|v| edge.contains(v));
                    if !shared
                        && passes(
                            &edge.map(|v| x[v as usize]),
                            &corners.map(|v| x[v as usize]),
                        )
                    {
                        found.push((*e, f));
                    }
                }
            }
        }
    }
}

impl Leaf {
    /// Bits of the triangles whose boxes have something in common with another one.
    fn meets(&self, [low, high]: &[[f32; 4]; 2]) -> u32 {
        let axis = |d: usize| {
            let above = f32x8::from(self.high[d]).simd_ge(f32x8::splat(low[d]));
            above & f32x8::from(self.low[d]).simd_le(f32x8::splat(high[d]))
        };
        (axis(0) & axis(1) & axis(2)).to_bitmask()
    }
}

/// Two boxes have nothing in common. Written so that the axes are compared together, without a branch.
fn apart(low: &[f32; 4], high: &[f32; 4], from: &[f32; 4], to: &[f32; 4]) -> bool {
    (0..4).fold(false, |a, c| a | (low[c] > to[c]) | (high[c] < from[c]))
}

fn below(p: &V3d) -> [f32; 4] {
    [
        (p.x as f32).next_down(),
        (p.y as f32).next_down(),
        (p.z as f32).next_down(),
        0.0,
    ]
}

fn above(p: &V3d) -> [f32; 4] {
    [
        (p.x as f32).next_up(),
        (p.y as f32).next_up(),
        (p.z as f32).next_up(),
        0.0,
    ]
}

/// A segment passes through a triangle: its ends lie on both sides, and it turns the same way around all three sides.
fn passes([p, q]: &[V3d; 2], [a, b, c]: &[V3d; 3]) -> bool {
    let volume = |a: &V3d, b: &V3d, c: &V3d, d: &V3d| (b - a).cross(&(c - a)).dot(&(d - a));
    let normal = (b - a).cross(&(c - a));
    if !(normal.dot(&(p - a)) * normal.dot(&(q - a)) < 0.0) {
        return false;
    }
    let around = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    around.iter().all(|v| *v > 0.0) || around.iter().all(|v| *v < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    /// Every edge with every triangle.
    fn slowly(faces: &[Face], positions: &[P3]) -> Vec<Crossing> {
        let x: Vec<V3d> = positions.iter().map(|p| p.coords.cast()).collect();
        let mut edges: Vec<[u32; 2]> = faces
            .iter()
            .flat_map(|f| [(0, 1), (1, 2), (2, 0)].map(|(i, j)| [f[i].min(f[j]), f[i].max(f[j])]))
            .collect();
        edges.sort_unstable();
        edges.dedup();
        let mut found = Vec::new();
        for e in edges {
            for (n, f) in faces.iter().enumerate() {
                if !f.iter().any(|v| e.contains(v))
                    && passes(&e.map(|v| x[v as usize]), &f.map(|v| x[v as usize]))
                {
                    found.push(Crossing {
                        edge: e,
                        face: n as u32,
                    });
                }
            }
        }
        found
    }

    #[test]
    fn a_needle_through_a_triangle_is_seen_and_one_beside_it_is_not() {
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
            crossings(&faces, &two.map(P3::from))
        };
        // Both long edges of the needle pass through, and at 0.2 so does one side of the triangle through the needle's.
        assert!(at(0.2).contains(&Crossing {
            edge: [3, 4],
            face: 0
        }));
        assert_eq!(at(1.2), []);
        assert_eq!(crossings(&faces[..1], &[P3::origin(); 3]), []);
    }

    #[test]
    fn a_sheet_without_end_breaks_nothing() {
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
            crossings(&[[0, 1, 2], [3, 4, 5]], &far(by).map(P3::from));
        }
    }

    #[test]
    fn the_tree_finds_what_a_look_at_every_pair_finds_also_after_the_sheet_has_moved() {
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
            let d = |p: &[P3]| -> Vec<V3d> { p.iter().map(|p| p.coords.cast()).collect() };
            let mut finder = Finder::new(&faces, &d(&first));
            for mut x in [first, points(n)] {
                for broken in [false, true] {
                    if broken && n > 2 {
                        x[4].x = f32::NAN;
                        x[7].y = f32::INFINITY;
                    }
                    let key = |c: &Crossing| (c.edge, c.face);
                    let mut fast: Vec<Crossing> = finder
                        .find(Par::Rayon, &d(&x))
                        .iter()
                        .map(|(e, f)| Crossing {
                            edge: finder.edges[*e as usize],
                            face: *f,
                        })
                        .collect();
                    fast.sort_by_key(key);
                    let slow = slowly(&faces, &x);
                    assert!(n < 300 || broken || slow.len() > 100, "{}", slow.len());
                    assert_eq!(fast, slow, "{n}");
                }
            }
        }
    }
}
