//! Untangles a sheet that intersects itself, without memory of how it came there.
//!
//! Intersecting edges cut vertices off: those are on the wrong side and move to the side of the rest. Where nothing is cut
//! off, the intersection contour is shortened until it vanishes (Volino & Magnenat-Thalmann 2006, "Resolving surface
//! collisions through intersection contour minimization").

use crate::settings::UntanglerSettings;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::{Face, UnionFind};
use tryon_geometry::par::Par;
use tryon_geometry::spatial::SelfIntersections;

/// Rings of wrong-side vertices that follow the intersecting edges in an iteration.
const FOLLOWING: usize = 4;
/// Rings around the intersections that the next iterations query: eight iterations of 3 mm reach no further.
const ACTIVE_RINGS: usize = 2;

/// Intersections before an iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct UntangleReport {
    /// Pairs of an edge and a triangle.
    pub(super) intersections: usize,
    /// Vertices on the wrong side.
    pub(super) wrong_side: usize,
}

/// Iterative untangling of one sheet, and scratch. Iterations query where the sheet intersected before, and all of it once
/// nothing is found there.
#[derive(Clone, Debug)]
pub(super) struct Untangler {
    /// Edges that pass through faces.
    pub(super) finder: SelfIntersections,
    /// Displacement of each vertex in the last iteration, metres, and its weight: 0 without intersection.
    pub(super) displacements: Vec<(V3d, f64)>,
    /// Edges that intersect the sheet an odd number of times.
    odd: Vec<bool>,
    wrong_side: Vec<bool>,
    /// Vertices of the sheet that each vertex is in.
    whole: Vec<u32>,
    /// Surroundings of the intersections that the last query of the whole sheet found.
    active: Option<ActivePatch>,
    settings: UntanglerSettings,
}

/// Part of the sheet, and the indices of its edges and triangles there.
#[derive(Clone, Debug)]
struct ActivePatch {
    finder: SelfIntersections,
    edges: Vec<u32>,
    faces: Vec<u32>,
}

impl ActivePatch {
    /// The triangles of `whole` with a marked corner, at `x`.
    fn new(whole: &SelfIntersections, near: &[bool], x: &[V3d]) -> Self {
        let (finder, [edges, faces]) = whole.subset(|f| f.iter().any(|v| near[*v as usize]), x);
        Self {
            finder,
            edges,
            faces,
        }
    }
    fn find(&mut self, par: Par, x: &[V3d]) -> Vec<(u32, u32)> {
        let found = self.finder.find(par, x);
        found
            .into_iter()
            .map(|(e, f)| (self.edges[e as usize], self.faces[f as usize]))
            .collect()
    }
}

/// Intersection of an edge and a triangle, and its resolution.
struct EdgeCut {
    /// The edge's ends and the triangle's corners.
    vertices: [usize; 5],
    /// Weights of their positions in the relative position of edge and triangle.
    weights: [f64; 5],
    /// Relative displacement that resolves it, metres.
    displacement: V3d,
}

impl Untangler {
    /// Prepares a sheet at `x`, metres.
    pub(super) fn new(faces: &[Face], x: &[V3d], settings: UntanglerSettings) -> Self {
        let mut new = Self {
            finder: SelfIntersections::new(faces, x),
            displacements: Vec::new(),
            odd: Vec::new(),
            wrong_side: Vec::new(),
            whole: Vec::new(),
            active: None,
            settings,
        };
        new.whole = new.part_sizes(x.len(), |_| false);
        new
    }
    /// Moves every intersecting edge against its triangle by a step at most, and wrong-side ends a gap beyond. `weights` are
    /// inverse masses, 0 for fixed vertices.
    pub(super) fn iterate(
        &mut self,
        par: Par,
        x: &mut [V3d],
        weights: impl Fn(usize) -> f64,
    ) -> UntangleReport {
        let UntanglerSettings {
            step,
            gap,
            straight,
            ..
        } = self.settings;
        let found = self.find(par, x);
        self.displacements.clear();
        self.displacements.resize(x.len(), (V3d::zeros(), 0.0));
        if found.is_empty() {
            return UntangleReport::default();
        }
        let wrong_side = self.mark_wrong_side(x.len(), &found);
        for (e, f) in &found {
            let ends = self.finder.edges()[*e as usize].map(|v| self.wrong_side[v as usize]);
            let corners = self.finder.faces()[*f as usize].map(|v| self.wrong_side[v as usize]);
            let Some(mut cut) = self.edge_cut(x, *e as usize, *f as usize) else {
                continue;
            };
            if ends[0] != ends[1] {
                cut.bring_back(x, usize::from(ends[1]), step, gap);
            } else if ends[0] || corners.contains(&true) {
                // It follows its neighbours.
                continue;
            } else {
                let turn = cut.displacement.norm_squared();
                cut.displacement *= step / (turn + straight * straight).sqrt();
            }
            self.add(&cut, &weights);
        }
        for (d, n) in &mut self.displacements {
            *d = if d.iter().all(|c| c.is_finite()) {
                *d / n.max(1.0)
            } else {
                V3d::zeros()
            };
        }
        if wrong_side > 0 {
            (0..FOLLOWING).for_each(|_| self.follow());
        }
        x.iter_mut()
            .zip(&self.displacements)
            .for_each(|(x, (d, _))| *x += *d);
        UntangleReport {
            intersections: found.len(),
            wrong_side,
        }
    }
    /// Forgets where the sheet intersected: it was moved by others.
    pub(super) fn invalidate(&mut self) {
        self.active = None;
    }
    fn find(&mut self, par: Par, x: &[V3d]) -> Vec<(u32, u32)> {
        if let Some(active) = &mut self.active {
            let found = active.find(par, x);
            if !found.is_empty() {
                return found;
            }
        }
        let found = self.finder.find(par, x);
        self.active = None;
        if !found.is_empty() {
            let mut near = vec![false; x.len()];
            for (e, f) in &found {
                let corners = self.finder.faces()[*f as usize];
                self.finder.edges()[*e as usize]
                    .iter()
                    .chain(&corners)
                    .for_each(|v| near[*v as usize] = true);
            }
            (0..ACTIVE_RINGS).for_each(|_| self.grow(&mut near));
            self.active = Some(ActivePatch::new(&self.finder, &near, x));
        }
        found
    }
    /// Marks the neighbours of marked vertices too.
    fn grow(&self, marked: &mut [bool]) {
        let edges = self.finder.edges().iter();
        let touched = edges.filter(|e| e.iter().any(|v| marked[*v as usize]));
        let ring: Vec<u32> = touched.flatten().copied().collect();
        ring.iter().for_each(|v| marked[*v as usize] = true);
    }
    /// Wrong-side vertices without an intersecting edge follow their neighbours.
    fn follow(&mut self) {
        let mut followers: Vec<(u32, V3d)> = Vec::new();
        for e in self.finder.edges() {
            for [a, b] in [[e[0], e[1]], [e[1], e[0]]] {
                if self.wrong_side[a as usize]
                    && self.displacements[a as usize].1 == 0.0
                    && self.displacements[b as usize].1 > 0.0
                {
                    followers.push((a, self.displacements[b as usize].0));
                }
            }
        }
        for (v, d) in followers {
            let (mean, n) = &mut self.displacements[v as usize];
            *n += 1.0;
            *mean += (d - *mean) / *n;
        }
    }
    /// Vertices of the part of each vertex, connected by edges that are not cut.
    fn part_sizes(&self, n: usize, is_cut: impl Fn(usize) -> bool) -> Vec<u32> {
        let mut parts = UnionFind::new(n);
        let edges = self.finder.edges().iter().enumerate();
        edges
            .filter(|(k, _)| !is_cut(*k))
            .for_each(|(_, [a, b])| parts.join(*a, *b));
        let roots: Vec<u32> = (0..n as u32).map(|v| parts.root(v)).collect();
        let mut size = vec![0; n];
        roots.iter().for_each(|r| size[*r as usize] += 1);
        roots.into_iter().map(|r| size[r as usize]).collect()
    }
    /// Marks and counts vertices that edges with an odd number of intersections cut off.
    fn mark_wrong_side(&mut self, n: usize, found: &[(u32, u32)]) -> usize {
        self.odd.clear();
        self.odd.resize(self.finder.edges().len(), false);
        found
            .iter()
            .for_each(|(e, _)| self.odd[*e as usize] ^= true);
        let parts = self.part_sizes(n, |k| self.odd[k]);
        self.wrong_side.clear();
        self.wrong_side.extend(
            parts
                .iter()
                .zip(&self.whole)
                .map(|(p, w)| f64::from(*p) < self.settings.cut_off * f64::from(*w)),
        );
        self.wrong_side.iter().filter(|w| **w).count()
    }
    fn add(&mut self, cut: &EdgeCut, weights: &impl Fn(usize) -> f64) {
        let w = cut.vertices.map(weights);
        let c = &cut.weights;
        let mass: f64 = (0..5).map(|k| w[k] * c[k] * c[k]).sum();
        if mass > 0.0 {
            for k in 0..5 {
                let (sum, n) = &mut self.displacements[cut.vertices[k]];
                *sum += cut.displacement * (w[k] * c[k] / mass);
                *n += c[k].abs();
            }
        }
    }
    /// The displacement shortens the contour and is not scaled yet. `None` for a triangle without area.
    fn edge_cut(&self, x: &[V3d], e: usize, f: usize) -> Option<EdgeCut> {
        let ends = self.finder.edges()[e].map(|v| v as usize);
        let corners = self.finder.faces()[f].map(|v| v as usize);
        let [p, q] = ends.map(|v| x[v]);
        let [a, b, c] = corners.map(|v| x[v]);
        let full = (b - a).cross(&(c - a));
        let normal = full.try_normalize(0.0)?;
        let along = (q - p).try_normalize(0.0)?;
        let (from, to) = (normal.dot(&(p - a)), normal.dot(&(q - a)));
        let t = from / (from - to);
        let at = p + (q - p) * t;
        let share = |u: &V3d, v: &V3d| (u - at).cross(&(v - at)).dot(&full) / full.norm_squared();
        let steep = along.dot(&normal);
        let steep = steep.signum() * steep.abs().max(self.settings.min_sine);
        let mut displacement = V3d::zeros();
        for n in self.finder.faces_beside(e) {
            let face = self.finder.faces()[n as usize].map(|v| v as usize);
            let Some(tip) = face.into_iter().find(|v| !ends.contains(v)) else {
                continue;
            };
            // Into the triangle beside the edge, away from the edge.
            let inwards = (x[tip] - p) - along * along.dot(&(x[tip] - p));
            let Some(line) = normal.cross(&along.cross(&inwards)).try_normalize(0.0) else {
                continue;
            };
            let line = if line.dot(&inwards) < 0.0 {
                -line
            } else {
                line
            };
            displacement += line - normal * (self.settings.steepness * along.dot(&line) / steep);
        }
        let weights = [1.0 - t, t, -share(&b, &c), -share(&c, &a), -share(&a, &b)];
        let is_finite = weights.iter().chain(&displacement).all(|c| c.is_finite());
        is_finite.then_some(EdgeCut {
            vertices: [ends[0], ends[1], corners[0], corners[1], corners[2]],
            weights,
            displacement,
        })
    }
}

impl EdgeCut {
    /// Moves end `wrong` of the edge to the side of the other end, and `gap` metres beyond the triangle.
    fn bring_back(&mut self, x: &[V3d], wrong: usize, step: f64, gap: f64) {
        let [p, q] = [self.vertices[wrong], self.vertices[1 - wrong]].map(|v| x[v]);
        let [a, b, c] = [self.vertices[2], self.vertices[3], self.vertices[4]].map(|v| x[v]);
        let normal = (b - a)
            .cross(&(c - a))
            .try_normalize(0.0)
            .unwrap_or_else(V3d::zeros);
        let out = if normal.dot(&(q - p)) < 0.0 {
            -normal
        } else {
            normal
        };
        self.displacement = out * (out.dot(&(a - p)) + gap).min(step);
        self.weights[wrong] = 1.0;
        self.weights[1 - wrong] = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::mesh::Face;

    /// Grid of `nu` by `nv` cells; `at(u, v)` in cells.
    fn grid(
        nu: usize,
        nv: usize,
        first: usize,
        at: impl Fn(f64, f64) -> [f64; 3],
    ) -> (Vec<V3d>, Vec<Face>) {
        let mut x = Vec::new();
        for i in 0..=nu {
            for j in 0..=nv {
                x.push(V3d::from(at(i as f64, j as f64)));
            }
        }
        let id = |i: usize, j: usize| (first + i * (nv + 1) + j) as u32;
        let mut faces = Vec::new();
        for i in 0..nu {
            for j in 0..nv {
                faces.push([id(i, j), id(i + 1, j), id(i + 1, j + 1)]);
                faces.push([id(i, j), id(i + 1, j + 1), id(i, j + 1)]);
            }
        }
        (x, faces)
    }

    fn two(a: (Vec<V3d>, Vec<Face>), b: (Vec<V3d>, Vec<Face>)) -> (Vec<V3d>, Vec<Face>) {
        ([a.0, b.0].concat(), [a.1, b.1].concat())
    }

    fn settings(step: f64, gap: f64) -> UntanglerSettings {
        UntanglerSettings {
            step,
            gap,
            ..UntanglerSettings::default()
        }
    }

    /// Intersections by iteration until there are none, at most `most`.
    fn untangle(mut x: Vec<V3d>, faces: &[Face], most: usize) -> Vec<usize> {
        let mut u = Untangler::new(faces, &x, settings(0.002, 0.001));
        let mut counts = Vec::new();
        let rest: Vec<f64> = u
            .finder
            .edges()
            .iter()
            .map(|e| (x[e[0] as usize] - x[e[1] as usize]).norm())
            .collect();
        for _ in 0..most {
            let r = u.iterate(Par::Seq, &mut x, |_| 1.0);
            for _ in 0..4 {
                for (e, l) in u.finder.edges().iter().zip(&rest) {
                    let [a, b] = e.map(|v| v as usize);
                    let d = x[a] - x[b];
                    let push = d * (0.5 * (d.norm() - l) / d.norm());
                    x[a] -= push;
                    x[b] += push;
                }
            }
            counts.push(r.intersections);
            if r.intersections == 0 {
                break;
            }
        }
        counts
    }

    const CELL: f64 = 0.02;

    /// The corner of a sheet pushed through another one.
    #[test]
    fn corner_through_a_sheet_is_freed() {
        let flat = grid(12, 12, 0, |u, v| [(u - 6.1) * CELL, 0.0, (v - 6.2) * CELL]);
        let corner = grid(8, 8, flat.0.len(), |u, v| {
            // Upright, its lowest corner 1.2 cm below the other sheet.
            let (a, b) = (u * CELL * 0.5f64.sqrt(), v * CELL * 0.5f64.sqrt());
            [a - b, a + b - 0.012, 0.003]
        });
        let (x, faces) = two(flat, corner);
        let counts = untangle(x, &faces, 60);
        assert_eq!(counts.last(), Some(&0));
    }

    /// A tube that stands 15 mm through a sheet.
    #[test]
    fn tube_through_a_sheet_is_freed() {
        for sag in [0.0, 0.2] {
            let flat = grid(16, 16, 0, |u, v| [(u - 8.1) * CELL, 0.0, (v - 8.2) * CELL]);
            let n = flat.0.len();
            let tube = grid(20, 8, n, |u, v| {
                let (s, c) = (u * std::f64::consts::TAU / 20.0).sin_cos();
                // Lies along x, its lowest line below the sheet.
                [
                    (v - 4.0) * CELL,
                    0.05 * c + 0.035 + sag * ((v - 4.0) * CELL).powi(2),
                    0.05 * s,
                ]
            });
            let (mut x, mut faces) = two(flat, tube);
            // Closed: the last column is the first.
            let last = n + 20 * 9;
            faces.iter_mut().flatten().for_each(|v| {
                if *v as usize >= last {
                    *v -= 20 * 9;
                }
            });
            x.truncate(last);
            let counts = untangle(x, &faces, 200);
            assert_eq!(counts.last(), Some(&0), "{sag}");
        }
    }

    /// A sheet in two layers 4 mm apart, the upper one with a bump of 9 mm downwards.
    #[test]
    fn bump_through_a_fold_is_freed() {
        let strip = grid(24, 8, 0, |u, v| {
            let along = u.min(24.0 - u) * CELL;
            let bump = if u > 12.0 {
                0.009 * (-(((u - 19.2) / 1.6).powi(2) + ((v - 4.1) / 1.6).powi(2))).exp()
            } else {
                0.0
            };
            [along, if u > 12.0 { 0.004 - bump } else { 0.0 }, v * CELL]
        });
        let counts = untangle(strip.0, &strip.1, 60);
        assert!(counts[0] > 4, "{counts:?}");
        assert_eq!(counts.last(), Some(&0), "{counts:?}");
    }

    #[test]
    fn degenerate_and_fixed_triangles_stay() {
        let faces: Vec<Face> = vec![[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]];
        let mut x: Vec<V3d> = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.2, 0.2, -1.0],
            [0.2, 0.2, 1.0],
            [9.0, 0.2, 0.0],
            [0.3, 0.3, -1.0],
            [0.3, 0.3, 1.0],
            [0.3, 0.3, 0.0],
            [f64::NAN, 0.3, 0.2],
            [0.1, 0.1, 1.0],
            [0.1, 0.1, -1.0],
        ]
        .map(V3d::from)
        .to_vec();
        let before = x.clone();
        let mut u = Untangler::new(&faces, &x, settings(0.01, 0.001));
        let held = u.iterate(Par::Seq, &mut x, |_| 0.0);
        assert!(held.intersections > 0);
        assert!(x.iter().zip(&before).all(|(a, b)| a == b || b.x.is_nan()));
        u.iterate(Par::Seq, &mut x, |_| 1.0);
        let bound = 0.1;
        assert!(
            x.iter()
                .zip(&before)
                .all(|(a, b)| (a - b).norm() < bound || b.x.is_nan()),
            "{x:?}"
        );
        assert_ne!(x[0], before[0]);
    }
}
