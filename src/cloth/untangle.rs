//! Takes a sheet that passes through itself apart. No side is remembered, so it does not matter how it came there.
//!
//! Edges that pass through the sheet cut vertices off: those are on the wrong side and go to the side of the rest. Where
//! nothing is cut off, the line in which the sheet meets itself is made shorter until it is gone: intersection contour
//! minimisation (Volino & Magnenat-Thalmann 2006, "Resolving surface collisions through intersection contour
//! minimization").

use crate::math::V3d;
use crate::mesh::smoothing::mean;
use crate::mesh::{Csr, Face};
use crate::par::Par;
use crate::spatial::SelfIntersections;

/// An edge flatter in a triangle than this (sine of the angle between them) is taken to be as steep: where it comes out
/// says too much.
const FLATTEST: f64 = 0.05;
/// Lines that turn less than this (length of the sum of two unit vectors) push by less than a whole step.
const STRAIGHT: f64 = 1.0;
/// What the steepness of an edge counts against the way of the line (Volino & Magnenat-Thalmann, eq. 5).
const STEEP: f64 = 2.0;
/// A part that is cut off is on the wrong side where it has less than this share of its sheet's vertices.
const SMALL: f64 = 0.3;

/// Rings of vertices beyond the crossing edges that follow them in a round.
const FOLLOWING: usize = 4;
/// Rings of vertices beyond them in which the next rounds look for crossings: in eight rounds of 3 mm they go no further.
const AROUND: usize = 2;

/// Rounds of averaging in one ironing.
const IRONED: usize = 4;

/// What one round found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Round {
    /// Edges through triangles.
    pub(crate) crossings: usize,
    /// Vertices on the wrong side.
    pub(crate) astray: usize,
}

/// A sheet that is taken out of itself round by round, and scratch for it. Where it crossed itself the next rounds look
/// first, and everywhere where nothing is found there.
#[derive(Clone, Debug)]
pub(crate) struct Untangler {
    pub(crate) finder: SelfIntersections,
    /// How far the last round moved each vertex, metres, and the weight of what it is the mean of: 0 where nothing crossed.
    pub(crate) pushes: Vec<(V3d, f64)>,
    /// Which part each vertex is in, by way of others of it.
    part: Vec<u32>,
    size: Vec<u32>,
    odd: Vec<bool>,
    wrong: Vec<bool>,
    /// Size of the sheet that each vertex is in.
    whole: Vec<u32>,
    /// What is near a crossing that the last look at everything found, if there was one.
    hot: Option<Hot>,
}

/// A piece of the sheet, and the numbers that its edges and triangles have there.
#[derive(Clone, Debug)]
struct Hot {
    finder: SelfIntersections,
    edges: Vec<u32>,
    faces: Vec<u32>,
}

impl Hot {
    /// The triangles of `whole` with a corner that is `near`, at `x`.
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

/// Where an edge meets a triangle, and which way out.
struct Meeting {
    /// The edge's ends and the triangle's corners.
    vertices: [usize; 5],
    /// What each counts for in the place of the edge against the triangle.
    weights: [f64; 5],
    /// The edge goes there against the triangle, metres.
    way: V3d,
}

impl Untangler {
    /// For a sheet that is at `x`.
    pub(crate) fn new(faces: &[Face], x: &[V3d]) -> Self {
        let mut new = Self {
            finder: SelfIntersections::new(faces, x),
            pushes: Vec::new(),
            part: Vec::new(),
            size: Vec::new(),
            odd: Vec::new(),
            wrong: Vec::new(),
            whole: Vec::new(),
            hot: None,
        };
        new.whole = new.parts(x.len(), false);
        new
    }
    /// Every edge that passes through a triangle is moved against it by up to `step` metres, and `gap` metres beyond it.
    /// `weights` are inverse masses, 0 for what may not move.
    pub(crate) fn round(
        &mut self,
        par: Par,
        x: &mut [V3d],
        weights: impl Fn(usize) -> f64,
        step: f64,
        gap: f64,
    ) -> Round {
        let found = self.find(par, x);
        self.pushes.clear();
        self.pushes.resize(x.len(), (V3d::zeros(), 0.0));
        if found.is_empty() {
            return Round::default();
        }
        let astray = self.part(x.len(), &found);
        for (e, f) in &found {
            let ends = self.finder.edges()[*e as usize].map(|v| self.wrong[v as usize]);
            let corners = self.finder.faces()[*f as usize].map(|v| self.wrong[v as usize]);
            let Some(mut m) = self.meeting(x, *e as usize, *f as usize) else {
                continue;
            };
            if ends[0] != ends[1] {
                m.bring_back(x, usize::from(ends[1]), step, gap);
            } else if ends[0] || corners.contains(&true) {
                // Others tell where that goes.
                continue;
            } else {
                m.way *= step / (m.way.norm_squared() + STRAIGHT * STRAIGHT).sqrt();
            }
            self.push(&m, &weights);
        }
        for (push, n) in &mut self.pushes {
            *push = if push.iter().all(|c| c.is_finite()) {
                *push / n.max(1.0)
            } else {
                V3d::zeros()
            };
        }
        if astray > 0 {
            (0..FOLLOWING).for_each(|_| self.follow());
        }
        x.iter_mut()
            .zip(&self.pushes)
            .for_each(|(x, (push, _))| *x += *push);
        Round {
            crossings: found.len(),
            astray,
        }
    }
    /// The next round looks for crossings everywhere: the sheet was moved by others.
    pub(crate) fn look_anew(&mut self) {
        self.hot = None;
    }
    /// Vertices of what crossed in the last round.
    pub(crate) fn crossed(&self) -> impl Iterator<Item = bool> {
        self.pushes.iter().map(|p| p.1 > 0.0)
    }
    /// Draws cloth within `rings` of what is `near` to the mean of its neighbours.
    pub(crate) fn iron(
        &self,
        x: &mut [V3d],
        mut near: Vec<bool>,
        movable: impl Fn(usize) -> bool,
        rings: usize,
    ) {
        let n = x.len();
        for _ in 0..rings {
            let ring: Vec<[u32; 2]> = self
                .finder
                .edges()
                .iter()
                .filter(|e| e.iter().any(|v| near[*v as usize]))
                .copied()
                .collect();
            ring.iter().flatten().for_each(|v| near[*v as usize] = true);
        }
        let pairs: Vec<(u32, u32)> = self
            .finder
            .edges()
            .iter()
            .flat_map(|&[a, b]| [(a, b), (b, a)])
            .filter(|(a, _)| near[*a as usize])
            .collect();
        let neighbours = Csr::from_pairs(n, &pairs);
        for _ in 0..IRONED {
            let halfway = |v: usize| {
                let middle = mean(neighbours.row(v).iter().map(|a| &x[*a as usize]))?;
                Some((v, (x[v] + middle) * 0.5))
            };
            let movable = (0..n).filter(|v| near[*v] && movable(*v));
            let moved: Vec<_> = movable.filter_map(halfway).collect();
            moved.into_iter().for_each(|(v, to)| x[v] = to);
        }
    }
    fn find(&mut self, par: Par, x: &[V3d]) -> Vec<(u32, u32)> {
        if let Some(hot) = &mut self.hot {
            let found = hot.find(par, x);
            if !found.is_empty() {
                return found;
            }
        }
        let found = self.finder.find(par, x);
        self.hot = None;
        if !found.is_empty() {
            let mut near = vec![false; x.len()];
            for (e, f) in &found {
                let corners = self.finder.faces()[*f as usize];
                self.finder.edges()[*e as usize]
                    .iter()
                    .chain(&corners)
                    .for_each(|v| near[*v as usize] = true);
            }
            for _ in 0..AROUND {
                let touches = |e: &&[u32; 2]| e.iter().any(|v| near[*v as usize]);
                let ring: Vec<[u32; 2]> = self
                    .finder
                    .edges()
                    .iter()
                    .filter(touches)
                    .copied()
                    .collect();
                ring.iter().flatten().for_each(|v| near[*v as usize] = true);
            }
            self.hot = Some(Hot::new(&self.finder, &near, x));
        }
        found
    }
    /// Vertices on the wrong side that no crossing edge tells where to go follow those beside them.
    fn follow(&mut self) {
        let mut told: Vec<(u32, V3d)> = Vec::new();
        for e in self.finder.edges() {
            for [a, b] in [[e[0], e[1]], [e[1], e[0]]] {
                if self.wrong[a as usize]
                    && self.pushes[a as usize].1 == 0.0
                    && self.pushes[b as usize].1 > 0.0
                {
                    told.push((a, self.pushes[b as usize].0));
                }
            }
        }
        for (v, push) in told {
            let (sum, n) = &mut self.pushes[v as usize];
            *n += 1.0;
            *sum += (push - *sum) / *n;
        }
    }
    fn root(&mut self, mut v: u32) -> u32 {
        while self.part[v as usize] != v {
            self.part[v as usize] = self.part[self.part[v as usize] as usize];
            v = self.part[v as usize];
        }
        v
    }
    /// Size of the part of each vertex, held together by edges that are not cut.
    fn parts(&mut self, n: usize, cut: bool) -> Vec<u32> {
        self.part.clear();
        self.part.extend(0..n as u32);
        self.size.clear();
        self.size.resize(n, 1);
        for k in 0..self.finder.edges().len() {
            if cut && self.odd[k] {
                continue;
            }
            let [a, b] = self.finder.edges()[k].map(|v| self.root(v));
            if a != b {
                let (small, large) = if self.size[a as usize] < self.size[b as usize] {
                    (a, b)
                } else {
                    (b, a)
                };
                self.part[small as usize] = large;
                self.size[large as usize] += self.size[small as usize];
            }
        }
        (0..n as u32)
            .map(|v| {
                let root = self.root(v);
                self.size[root as usize]
            })
            .collect()
    }
    /// Which vertices are on the wrong side: cut off by edges that pass through the sheet an odd number of times.
    fn part(&mut self, n: usize, found: &[(u32, u32)]) -> usize {
        self.odd.clear();
        self.odd.resize(self.finder.edges().len(), false);
        found
            .iter()
            .for_each(|(e, _)| self.odd[*e as usize] ^= true);
        let parts = self.parts(n, true);
        self.wrong.clear();
        self.wrong.extend(
            parts
                .iter()
                .zip(&self.whole)
                .map(|(p, w)| f64::from(*p) < SMALL * f64::from(*w)),
        );
        self.wrong.iter().filter(|w| **w).count()
    }
    fn push(&mut self, m: &Meeting, weights: &impl Fn(usize) -> f64) {
        let w = m.vertices.map(weights);
        let mass: f64 = (0..5).map(|k| w[k] * m.weights[k] * m.weights[k]).sum();
        if mass > 0.0 {
            for k in 0..5 {
                let (sum, n) = &mut self.pushes[m.vertices[k]];
                *sum += m.way * (w[k] * m.weights[k] / mass);
                *n += m.weights[k].abs();
            }
        }
    }
    /// `None` where a triangle has no area. The way makes the line shorter and is not of any length yet.
    fn meeting(&self, x: &[V3d], e: usize, f: usize) -> Option<Meeting> {
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
        let steep = steep.signum() * steep.abs().max(FLATTEST);
        let mut way = V3d::zeros();
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
            way += line - normal * (STEEP * along.dot(&line) / steep);
        }
        let weights = [1.0 - t, t, -share(&b, &c), -share(&c, &a), -share(&a, &b)];
        let good = weights.iter().chain(&way).all(|c| c.is_finite());
        good.then_some(Meeting {
            vertices: [ends[0], ends[1], corners[0], corners[1], corners[2]],
            weights,
            way,
        })
    }
}

impl Meeting {
    /// The end number `astray` of the edge goes to the side of the other one, and `gap` beyond.
    fn bring_back(&mut self, x: &[V3d], astray: usize, step: f64, gap: f64) {
        let [p, q] = [self.vertices[astray], self.vertices[1 - astray]].map(|v| x[v]);
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
        self.way = out * (out.dot(&(a - p)) + gap).min(step);
        self.weights[astray] = 1.0;
        self.weights[1 - astray] = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Face;

    /// Rows and columns of points; `at(u, v)` in cells.
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

    /// Rounds until nothing crosses, at most `most`.
    fn rounds(
        (mut x, faces): (Vec<V3d>, Vec<Face>),
        step: f64,
        most: usize,
    ) -> (Vec<usize>, Vec<V3d>) {
        let mut u = Untangler::new(&faces, &x);
        let mut seen = Vec::new();
        let rest: Vec<f64> = u
            .finder
            .edges()
            .iter()
            .map(|e| (x[e[0] as usize] - x[e[1] as usize]).norm())
            .collect();
        for _ in 0..most {
            let r = u.round(Par::Seq, &mut x, |_| 1.0, step, 0.001);
            for _ in 0..4 {
                for (e, l) in u.finder.edges().iter().zip(&rest) {
                    let [a, b] = e.map(|v| v as usize);
                    let d = x[a] - x[b];
                    let push = d * (0.5 * (d.norm() - l) / d.norm());
                    x[a] -= push;
                    x[b] += push;
                }
            }
            seen.push(r.crossings);
            if r.crossings == 0 {
                break;
            }
        }
        (seen, x)
    }

    const CELL: f64 = 0.02;

    /// The corner of a sheet pushed through another one.
    #[test]
    fn a_corner_is_drawn_back_out_of_a_sheet() {
        let flat = grid(12, 12, 0, |u, v| [(u - 6.1) * CELL, 0.0, (v - 6.2) * CELL]);
        let corner = grid(8, 8, flat.0.len(), |u, v| {
            // Upright, its lowest corner 1.2 cm below the other sheet.
            let (a, b) = (u * CELL * 0.5f64.sqrt(), v * CELL * 0.5f64.sqrt());
            [a - b, a + b - 0.012, 0.003]
        });
        let (seen, _) = rounds(two(flat, corner), 0.002, 60);
        assert_eq!(seen.last(), Some(&0));
    }

    /// A tube that stands 15 mm through a sheet.
    #[test]
    fn a_tube_that_pokes_through_a_sheet_goes_back() {
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
            let (seen, _) = rounds((x, faces), 0.002, 200);
            assert_eq!(seen.last(), Some(&0), "{sag}");
        }
    }

    /// A sheet in two layers 4 mm apart, the upper one with a bump of 9 mm downwards.
    #[test]
    fn a_fold_that_a_bump_goes_through_is_freed() {
        let strip = grid(24, 8, 0, |u, v| {
            let along = u.min(24.0 - u) * CELL;
            let bump = if u > 12.0 {
                0.009 * (-(((u - 19.2) / 1.6).powi(2) + ((v - 4.1) / 1.6).powi(2))).exp()
            } else {
                0.0
            };
            [along, if u > 12.0 { 0.004 - bump } else { 0.0 }, v * CELL]
        });
        let (seen, _) = rounds(strip, 0.002, 60);
        assert!(seen[0] > 4, "{seen:?}");
        assert_eq!(seen.last(), Some(&0), "{seen:?}");
    }

    #[test]
    fn ironing_flattens_what_crossed_and_no_more() {
        let flat = grid(16, 16, 0, |u, v| [(u - 8.1) * CELL, 0.0, (v - 8.2) * CELL]);
        let n = flat.0.len();
        // A sheet above it with a spike through it.
        let spiked = grid(16, 16, n, |u, v| {
            let spike = if (u, v) == (8.0, 8.0) { 0.03 } else { 0.0 };
            [(u - 8.0) * CELL, 0.02 - spike, (v - 8.0) * CELL]
        });
        let (mut x, faces) = two(flat, spiked);
        let tip = n + 8 * 17 + 8;
        let mut u = Untangler::new(&faces, &x);
        assert!(u.round(Par::Seq, &mut x, |_| 1.0, 0.001, 0.0).crossings > 0);
        let before = x.clone();
        u.iron(&mut x, u.crossed().collect(), |v| v != tip, 2);
        assert_eq!(x[tip], before[tip], "it may not move");
        u.iron(&mut x, u.crossed().collect(), |_| true, 2);
        assert!(
            x[tip].y > before[tip].y + 0.01,
            "{} {}",
            x[tip].y,
            before[tip].y
        );
        // Three cells from the spike, of which one is an edge that crossed.
        let near = |v: usize| [0, 2].iter().all(|k| before[v][*k].abs() < 3.5 * CELL);
        assert!((0..x.len()).all(|v| near(v) || x[v] == before[v]));
        assert!(u.round(Par::Seq, &mut x, |_| 1.0, 0.001, 0.0).crossings == 0);
    }

    #[test]
    fn what_has_no_area_is_not_finite_or_may_not_move_stays_and_spoils_nothing() {
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
        let mut u = Untangler::new(&faces, &x);
        let held = u.round(Par::Seq, &mut x, |_| 0.0, 0.01, 0.001);
        assert!(held.crossings > 0);
        assert!(x.iter().zip(&before).all(|(a, b)| a == b || b.x.is_nan()));
        u.round(Par::Seq, &mut x, |_| 1.0, 0.01, 0.001);
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
