//! A bounding volume hierarchy over triangles, built once and refit as the vertices move.
//!
//! Axis-aligned boxes in single precision, rounded outwards, halved at the median of the longest axis. Leaves hold
//! eight triangles whose boxes are tested together (one wide register).

use super::triangle::{closest_on_triangle, ray_crossing};
use crate::math::{P3, V3, V3d};
use crate::mesh::{Face, face_normal};
use wide::f32x8;

/// Triangles of a leaf: the lanes of a wide register.
pub(super) const LEAF: usize = 8;
/// Absent triangle or leaf.
pub(super) const NONE: u32 = u32::MAX;

/// A vertex position in single or double precision, metres.
pub trait Position: Copy + Send + Sync {
    /// The position in double precision.
    fn double(self) -> V3d;
}

impl Position for V3d {
    fn double(self) -> V3d {
        self
    }
}

impl Position for P3 {
    fn double(self) -> V3d {
        self.coords.cast()
    }
}

/// Axis-aligned box; the fourth number is 0, so that comparisons fill a register.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) low: [f32; 4],
    pub(super) high: [f32; 4],
}

impl Bounds {
    pub(super) const EMPTY: Self = Self {
        low: [f32::INFINITY; 4],
        high: [f32::NEG_INFINITY; 4],
    };
    /// The box of some points, rounded outwards.
    pub(super) fn of<const N: usize>(points: [V3d; N]) -> Self {
        let (low, high) = points[1..]
            .iter()
            .fold((points[0], points[0]), |(l, h), p| (l.inf(p), h.sup(p)));
        let corner = |p: V3d, round: fn(f32) -> f32| {
            [round(p.x as f32), round(p.y as f32), round(p.z as f32), 0.0]
        };
        Self {
            low: corner(low, f32::next_down),
            high: corner(high, f32::next_up),
        }
    }
    pub(super) fn include(&mut self, other: &Self) {
        for c in 0..4 {
            self.low[c] = self.low[c].min(other.low[c]);
            self.high[c] = self.high[c].max(other.high[c]);
        }
    }
    /// All axes are compared together, without a branch.
    pub(super) fn is_apart(&self, o: &Self) -> bool {
        (0..4).fold(false, |apart, c| {
            apart | (self.low[c] > o.high[c]) | (self.high[c] < o.low[c])
        })
    }
    fn distance_squared(&self, p: &P3) -> f32 {
        (0..3).fold(0.0, |sum, c| {
            let beyond = (self.low[c] - p[c]).max(p[c] - self.high[c]).max(0.0);
            sum + beyond * beyond
        })
    }
}

/// Inner nodes are followed by their first child.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// The node after all descendants.
    skip: u32,
    /// Index of the leaf, [`NONE`] for inner nodes.
    leaf: u32,
}

/// Triangles that lie together, with their boxes axis by axis.
#[derive(Clone, Debug)]
pub(super) struct Leaf {
    pub(super) faces: [u32; LEAF],
    low: [[f32; LEAF]; 3],
    high: [[f32; LEAF]; 3],
}

impl Leaf {
    /// Squared distances of `p` from the triangles' boxes; NaN for absent ones.
    fn distances_squared(&self, p: &P3) -> [f32; LEAF] {
        let axis = |d: usize| {
            let (low, high) = (f32x8::from(self.low[d]), f32x8::from(self.high[d]));
            let beyond = (low - f32x8::splat(p[d])).fast_max(f32x8::splat(p[d]) - high);
            // NaN boxes stay NaN.
            let outside = beyond.simd_gt(f32x8::splat(0.0));
            outside.select(beyond, beyond * f32x8::splat(0.0))
        };
        let [a, b, c] = [axis(0), axis(1), axis(2)];
        (a * a + b * b + c * c).to_array()
    }
    /// Triangles whose boxes overlap `b`.
    pub(super) fn overlapping(&self, b: &Bounds) -> impl Iterator<Item = u32> + '_ {
        let axis = |d: usize| {
            let above = f32x8::from(self.high[d]).simd_ge(f32x8::splat(b.low[d]));
            above & f32x8::from(self.low[d]).simd_le(f32x8::splat(b.high[d]))
        };
        let mut left = (axis(0) & axis(1) & axis(2)).to_bitmask();
        std::iter::from_fn(move || {
            (left != 0).then(|| {
                let face = self.faces[left.trailing_zeros() as usize];
                left &= left - 1;
                face
            })
        })
    }
}

/// Nodes that wait in a search for a closest point: one a level, of at most 2³² triangles.
const DEPTH: usize = 40;

/// The point of a surface closest to a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Triangle.
    pub face: u32,
    /// Barycentric weights of its corners.
    pub weights: [f32; 3],
    /// The point, metres.
    pub point: P3,
    /// Distance from the query, metres.
    pub distance: f32,
}

/// Bounding volume hierarchy over the triangles of a mesh. Queries take the positions it was last refit to.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    faces: Vec<Face>,
    nodes: Vec<Node>,
    pub(super) leaves: Vec<Leaf>,
    /// Node of each leaf.
    leaf_nodes: Vec<u32>,
}

impl Bvh {
    /// Builds and fits the tree for triangles at `x` (shape `[vertices]`, metres).
    pub fn new<P: Position>(faces: &[Face], x: &[P]) -> Self {
        let middles: Vec<V3d> = faces
            .iter()
            .map(|f| f.iter().map(|v| x[*v as usize].double()).sum())
            .collect();
        let mut new = Self {
            faces: faces.to_vec(),
            ..Self::default()
        };
        new.split(&middles, &mut (0..middles.len() as u32).collect::<Vec<_>>());
        new.refit(x);
        new
    }

    /// Triangles, in the order of their numbers.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    fn split(&mut self, middles: &[V3d], some: &mut [u32]) {
        let at = self.nodes.len();
        let is_leaf = some.len() <= LEAF;
        self.nodes.push(Node {
            bounds: Bounds::EMPTY,
            skip: 0,
            leaf: if is_leaf {
                self.leaves.len() as u32
            } else {
                NONE
            },
        });
        if is_leaf {
            // NaN bounds of absent triangles overlap nothing, not even an infinite box.
            let nowhere = [[f32::NAN; LEAF]; 3];
            self.leaf_nodes.push(at as u32);
            self.leaves.push(Leaf {
                faces: std::array::from_fn(|l| some.get(l).copied().unwrap_or(NONE)),
                low: nowhere,
                high: nowhere,
            });
        } else {
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
        }
        self.nodes[at].skip = self.nodes.len() as u32;
    }

    /// Fits the boxes to new positions. Queries slow down where triangles of one leaf move far apart.
    pub fn refit<P: Position>(&mut self, x: &[P]) {
        for k in (0..self.nodes.len()).rev() {
            let mut bounds = Bounds::EMPTY;
            if let Some(leaf) = self.leaves.get_mut(self.nodes[k].leaf as usize) {
                for l in 0..LEAF {
                    let Some(f) = self.faces.get(leaf.faces[l] as usize) else {
                        break;
                    };
                    let own = Bounds::of(f.map(|v| x[v as usize].double()));
                    bounds.include(&own);
                    (0..3).for_each(|d| {
                        (leaf.low[d][l], leaf.high[d][l]) = (own.low[d], own.high[d])
                    });
                }
            } else {
                let second = self.nodes[k + 1].skip as usize;
                bounds.include(&self.nodes[k + 1].bounds);
                bounds.include(&self.nodes[second].bounds);
            }
            self.nodes[k].bounds = bounds;
        }
    }

    /// Calls `visit` with the leaves at and after node `k` whose boxes `enters` accepts.
    fn traverse_from(
        &self,
        mut k: usize,
        mut enters: impl FnMut(&Bounds) -> bool,
        mut visit: impl FnMut(&Bounds, u32),
    ) {
        while let Some(n) = self.nodes.get(k) {
            if !enters(&n.bounds) {
                k = n.skip as usize;
                continue;
            }
            k += 1;
            if n.leaf != NONE {
                visit(&n.bounds, n.leaf);
            }
        }
    }

    /// Calls `visit` with the box and the index of every leaf that overlaps `b`.
    pub(super) fn overlapping_leaves(&self, b: &Bounds, visit: impl FnMut(&Bounds, u32)) {
        self.traverse_from(0, |n| !n.is_apart(b), visit);
    }

    /// Triangles whose boxes overlap the box from `low` to `high`, metres; in no particular order.
    pub fn overlapping(&self, low: [f32; 3], high: [f32; 3], mut visit: impl FnMut(u32)) {
        let wide = |p: [f32; 3]| [p[0], p[1], p[2], 0.0];
        let b = Bounds {
            low: wide(low),
            high: wide(high),
        };
        self.overlapping_leaves(&b, |_, leaf| {
            self.leaves[leaf as usize]
                .overlapping(&b)
                .for_each(&mut visit);
        });
    }

    /// Number of leaves: groups of eight triangles at most that lay together when the tree was built.
    pub fn leaf_count(&self) -> usize {
        self.leaves.len()
    }

    /// Triangles of one leaf.
    pub fn leaf(&self, leaf: usize) -> impl Iterator<Item = u32> + '_ {
        let all = self.leaves[leaf].faces.iter().copied();
        all.take_while(|f| *f != NONE)
    }

    /// Calls `visit` with the index of a box (low, high; metres) and each triangle of the leaves from `first` on whose
    /// box overlaps it, in no particular order: one traversal for boxes that lie together.
    pub fn overlapping_group(
        &self,
        boxes: &[[[f32; 3]; 2]],
        first: usize,
        mut visit: impl FnMut(usize, u32),
    ) {
        let wide = |p: [f32; 3]| [p[0], p[1], p[2], 0.0];
        let bounds = |[low, high]: &[[f32; 3]; 2]| Bounds {
            low: wide(*low),
            high: wide(*high),
        };
        let mut all = Bounds::EMPTY;
        boxes.iter().for_each(|b| all.include(&bounds(b)));
        // Leaves ascend along the nodes, so a traversal may begin at any of them.
        let from = match first {
            0 => 0,
            _ => self
                .leaf_nodes
                .get(first)
                .map_or(self.nodes.len(), |n| *n as usize),
        };
        let enters = |n: &Bounds| !n.is_apart(&all);
        self.traverse_from(from, enters, |node, leaf| {
            for (k, b) in boxes.iter().enumerate() {
                let b = bounds(b);
                if !node.is_apart(&b) {
                    let found = self.leaves[leaf as usize].overlapping(&b);
                    found.for_each(|face| visit(k, face));
                }
            }
        });
    }

    fn corners(&self, face: u32, x: &[P3]) -> [P3; 3] {
        self.faces[face as usize].map(|v| x[v as usize])
    }

    /// Unit normal of a triangle; `None` for one without area.
    pub fn unit_normal(&self, x: &[P3], face: u32) -> Option<V3> {
        face_normal(x, &self.faces[face as usize]).try_normalize(f32::MIN_POSITIVE)
    }

    /// Winding number of the surface around `p`, by the crossings of a ray along +z: 0 outside, 1 inside, 2 where two
    /// parts of the surface lie in each other. Outward faces are counter-clockwise.
    pub fn winding_number(&self, x: &[P3], p: &P3) -> i32 {
        let mut sum = 0;
        self.overlapping([p.x, p.y, p.z], [p.x, p.y, f32::INFINITY], |face| {
            sum += ray_crossing(p, self.corners(face, x));
        });
        sum
    }

    /// The surface point closest to `p`; `None` for an empty mesh.
    pub fn closest(&self, x: &[P3], p: &P3) -> Option<SurfacePoint> {
        self.closest_near(x, p, None)
    }

    /// [`Bvh::closest`], faster from the triangle `near`, whose distance bounds the search.
    pub fn closest_near(&self, x: &[P3], p: &P3, near: Option<u32>) -> Option<SurfacePoint> {
        let mut best = near
            .filter(|f| (*f as usize) < self.faces.len())
            .map(|f| self.point_of_face(x, p, f));
        let mut bound = best.map_or(f32::INFINITY, |b| b.distance * b.distance);
        // Nodes to visit with their distances; the nearer child is visited first.
        let mut stack = [(0.0f32, 0u32); DEPTH];
        let mut top = usize::from(!self.nodes.is_empty());
        while top > 0 {
            top -= 1;
            let (distance, k) = stack[top];
            if distance >= bound {
                continue;
            }
            let node = &self.nodes[k as usize];
            if node.leaf != NONE {
                self.closest_of_leaf(x, p, node.leaf, &mut bound, &mut best);
                continue;
            }
            let children = [k + 1, self.nodes[k as usize + 1].skip];
            let [left, right] =
                children.map(|c| (self.nodes[c as usize].bounds.distance_squared(p), c));
            let (first, second) = if left.0 <= right.0 {
                (left, right)
            } else {
                (right, left)
            };
            for child in [second, first] {
                if child.0 < bound && top < DEPTH {
                    stack[top] = child;
                    top += 1;
                }
            }
        }
        best
    }

    /// Point of one triangle closest to `p`; `x` are the vertices.
    pub fn point_of_face(&self, x: &[P3], p: &P3, face: u32) -> SurfacePoint {
        let corners = self.corners(face, x);
        let weights = closest_on_triangle(p, corners);
        let sum = |k: usize| corners[k].coords * weights[k];
        let point = P3::from(sum(0) + sum(1) + sum(2));
        SurfacePoint {
            face,
            weights,
            point,
            distance: (point - p).norm(),
        }
    }

    fn closest_of_leaf(
        &self,
        x: &[P3],
        p: &P3,
        leaf: u32,
        bound: &mut f32,
        best: &mut Option<SurfacePoint>,
    ) {
        let leaf = &self.leaves[leaf as usize];
        let boxes = leaf.distances_squared(p);
        for (face, distance) in leaf.faces.iter().zip(boxes) {
            // Absent triangles have NaN distances.
            if distance < *bound {
                let found = self.point_of_face(x, p, *face);
                let square = found.distance * found.distance;
                if square < *bound {
                    *bound = square;
                    *best = Some(found);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::two_boxes;
    use crate::spatial::brute;
    use rand::{Rng, SeedableRng};

    #[test]
    fn winding_number_closest_point_and_overlap_agree_with_brute_force_after_a_refit() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(11);
        let (x, faces) = two_boxes(0.0);
        let mut bvh = Bvh::new(&faces, &x);
        for shift in [0.0, -0.3, 2.0] {
            let (x, _) = two_boxes(shift);
            bvh.refit(&x);
            let mut counts = [0; 3];
            for _ in 0..2000 {
                let p = P3::new(
                    rng.random_range(-0.5..2.5),
                    rng.random_range(-0.3..0.6),
                    rng.random_range(-0.2..0.5),
                );
                let winding = bvh.winding_number(&x, &p);
                assert_eq!(winding, brute::winding_number(&faces, &x, &p), "{p}");
                counts[winding as usize] += 1;
                let near = bvh.closest(&x, &p).expect("a surface");
                let slow = brute::distance(&faces, &x, &p);
                assert!((near.distance - slow).abs() < 1e-6, "{p}: {near:?} {slow}");
                assert!(((near.point - p).norm() - near.distance).abs() < 1e-6);
                let high = [p.x + 0.2, p.y + 0.1, p.z + 0.1];
                let mut found = Vec::new();
                bvh.overlapping([p.x, p.y, p.z], high, |f| found.push(f));
                found.sort_unstable();
                assert_eq!(
                    found,
                    brute::overlapping(&faces, &x, [p.x, p.y, p.z], high),
                    "{p}"
                );
            }
            assert!(counts[0] > 50 && counts[1] > 50, "{counts:?}");
            assert_eq!(counts[2] > 0, shift <= 0.0, "{counts:?}");
        }
    }

    #[test]
    fn empty_mesh_has_no_inside_and_no_closest_point() {
        let bvh = Bvh::new::<P3>(&[], &[]);
        assert_eq!(bvh.winding_number(&[], &P3::origin()), 0);
        assert_eq!(bvh.closest(&[], &P3::origin()), None);
    }
}
