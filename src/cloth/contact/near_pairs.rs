//! Near pairs of features of an outfit: vertices and faces, edges and edges, of two garments or of folds of one.

use crate::cloth::outfit_model::Model;
use crate::cloth::patch::PatchWork;
use crate::cloth::state::State;
use crate::contact::SurfaceModel;
use crate::math::{P3, V3};
use crate::par;
use crate::spatial::{HashGrid, closest_on_triangle};
use std::ops::Range;

/// Vertices that one thread queries in a row.
const CHUNK: usize = 256;
/// Largest distance of pairs at rest, in edge lengths: with 0.4 a dance has four times the crossings.
const REACH_EDGES: f32 = 0.5;
/// Largest distance of pairs that close fast, metres: folds meet at 1 m/s in an interval of 8 ms. 15 mm cost 2 % more.
const FARTHEST: f32 = 0.012;
/// Shortest distance that has a direction, metres.
const SHORTEST: f32 = 1e-5;
/// A corner with less barycentric weight has no part in a point.
const MIN_WEIGHT: f32 = 1e-4;
/// Least squared sine of the angle between two edges of a pair: parallel ones are met by their ends.
const MIN_SINE_SQUARED: f32 = 1e-3;

/// Two features. The first `below` vertices belong to the one, the others to the other, to which `normal` points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct NearPair {
    pub(super) vertices: [u32; 4],
    pub(super) below: usize,
    /// Unit direction of the closest points.
    pub(super) normal: V3,
}

impl NearPair {
    /// Direction from the other feature to that of vertex `i` of the pair.
    pub(super) fn outward(&self, i: usize) -> V3 {
        if i < self.below {
            -self.normal
        } else {
            self.normal
        }
    }
}

/// Face of a garment, in one word: these are sorted by the thousand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct NearFace(u64);

impl NearFace {
    fn new(garment: u32, face: u32) -> Self {
        Self(u64::from(garment) << 32 | u64::from(face))
    }
    fn garment(self) -> u32 {
        (self.0 >> 32) as u32
    }
    fn face(self) -> usize {
        self.0 as u32 as usize
    }
}

/// Edge, its smaller vertex first, in one word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct NearEdge(u64);

impl NearEdge {
    fn new(a: u32, b: u32) -> Self {
        Self(u64::from(a.min(b)) << 32 | u64::from(a.max(b)))
    }
    fn ends(self) -> [u32; 2] {
        [(self.0 >> 32) as u32, self.0 as u32]
    }
}

/// Findings of one chunk of vertices.
#[derive(Debug, Default)]
struct ChunkFindings {
    /// Near faces, vertex by vertex, and the end of those of each vertex.
    faces: Vec<NearFace>,
    ends: Vec<u32>,
    pairs: Vec<NearPair>,
    /// Scratch.
    candidates: Vec<NearFace>,
    edges: Vec<NearEdge>,
}

/// Vertices of all garments, numbered through, and their near pairs.
#[derive(Debug, Default)]
pub(super) struct NearPairs {
    /// First vertex of each garment, and the end.
    first: Vec<u32>,
    /// Garment of each vertex.
    owner: Vec<u32>,
    /// Metres, m/s.
    pub(super) x: Vec<P3>,
    pub(super) velocity: Vec<V3>,
    smoothed: Vec<V3>,
    grid: HashGrid,
    found: Vec<ChunkFindings>,
    pub(super) pairs: Vec<NearPair>,
}

impl NearPairs {
    /// Numbers the vertices.
    pub(super) fn number(&mut self, model: &Model) {
        self.first.clear();
        self.owner.clear();
        self.first.push(0);
        for (k, g) in (0u32..).zip(&model.garments) {
            self.owner.resize(self.owner.len() + g.sheet.mass.len(), k);
            self.first.push(self.owner.len() as u32);
        }
        self.x.resize(self.owner.len(), P3::origin());
        self.velocity.resize(self.owner.len(), V3::zeros());
    }

    /// Number of a vertex of a garment.
    pub(super) fn number_of(&self, garment: usize, v: u32) -> usize {
        (self.first[garment] + v) as usize
    }

    /// The features of a pair belong to two garments.
    pub(super) fn is_between_garments(&self, p: &NearPair) -> bool {
        self.owner[p.vertices[0] as usize] != self.owner[p.vertices[3] as usize]
    }

    /// Takes positions over, and a velocity by patch, vertex there and number here.
    pub(super) fn gather(
        &mut self,
        model: &Model,
        patches: &[PatchWork],
        velocity: impl Fn(&PatchWork, usize, usize) -> V3,
    ) {
        let mut rest = patches.iter();
        for (k, g) in model.garments.iter().enumerate() {
            for (f, p) in g.patches.iter().zip(&mut rest) {
                for (i, v) in f.vertices[..f.owned].iter().enumerate() {
                    let v = (self.first[k] + v) as usize;
                    self.velocity[v] = velocity(p, i, v);
                    self.x[v] = p.position(i);
                }
            }
        }
    }

    /// Moves velocities towards the means with their neighbours by a share.
    pub(super) fn smooth_velocities(&mut self, model: &Model, share: f32) {
        let (first, owner, from) = (&self.first, &self.owner, &self.velocity);
        let par = model.config.par;
        par::map_into(par, from.len(), 2048, &mut self.smoothed, |v| {
            let base = first[owner[v] as usize];
            let surface = &model.garments[owner[v] as usize].self_contact.surface;
            let around = surface.neighbours(v as u32 - base);
            let others = around.iter().map(|w| from[(w + base) as usize]);
            let mean = others.fold(from[v], |s, u| s + u) / (1 + around.len()) as f32;
            from[v] + (mean - from[v]) * share
        });
        std::mem::swap(&mut self.velocity, &mut self.smoothed);
    }

    /// Finds the pairs that may touch within `span` seconds.
    pub(super) fn find(&mut self, model: &Model, state: &State, span: f32) {
        let par = model.config.par;
        let edges = model.garments.iter().map(|g| g.self_contact.edge());
        let edge = edges.fold(0.0, f32::max);
        let reach = REACH_EDGES * edge;
        let farthest = reach.max(FARTHEST);
        // A corner of an equilateral triangle is at most its circumradius beside the closest point.
        let circumradius_squared = edge * edge / 3.0;
        let corner = (farthest * farthest + circumradius_squared).sqrt();
        self.grid.fill(&self.x, 2.0 * corner);

        let n = self.x.len();
        let mut found = std::mem::take(&mut self.found);
        found.resize_with(n.div_ceil(CHUNK), ChunkFindings::default);
        let range = |k: usize| k * CHUNK..((k + 1) * CHUNK).min(n);
        let search = NearPairSearch {
            model,
            state,
            all: self,
            reach,
            farthest,
            corner,
            circumradius_squared,
            corner_at_rest_squared: reach * reach + circumradius_squared,
            span,
        };
        par::for_chunks(par, &mut found, 1, |k, f| {
            search.find_faces(range(k), &mut f[0])
        });
        let (faces, ends) = join(&found);
        par::for_chunks(par, &mut found, 1, |k, f| {
            search.find_edges(&faces, &ends, range(k), &mut f[0]);
        });
        self.pairs.clear();
        for f in &found {
            self.pairs.extend_from_slice(&f.pairs);
        }
        self.found = found;
    }
}

/// Near faces of all vertices, and the end of those of each, the first end being 0.
fn join(found: &[ChunkFindings]) -> (Vec<NearFace>, Vec<u32>) {
    let (mut faces, mut ends) = (Vec::new(), vec![0]);
    for f in found {
        let base = faces.len() as u32;
        faces.extend_from_slice(&f.faces);
        ends.extend(f.ends.iter().map(|e| base + e));
    }
    (faces, ends)
}

/// Closest points of two edges if neither is an end: shares of the way along each, and the offset from the first to the
/// second, metres.
fn closest_inside(a: [P3; 2], b: [P3; 2]) -> Option<([f32; 2], V3)> {
    let (along_a, along_b, apart) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let (aa, bb) = (along_a.norm_squared(), along_b.norm_squared());
    let ab = along_a.dot(&along_b);
    let (pa, pb) = (along_a.dot(&apart), along_b.dot(&apart));
    let area = aa * bb - ab * ab;
    let (s, t) = (ab * pb - pa * bb, aa * pb - ab * pa);
    let is_inside = s > 0.0 && s < area && t > 0.0 && t < area;
    if !is_inside || area < MIN_SINE_SQUARED * aa * bb {
        return None;
    }
    let (s, t) = (s / area, t / area);
    Some(([s, t], along_b * t - along_a * s - apart))
}

/// One query.
struct NearPairSearch<'a> {
    model: &'a Model,
    state: &'a State,
    all: &'a NearPairs,
    /// Reach at rest and at most, and that of the query for corners, metres.
    reach: f32,
    farthest: f32,
    corner: f32,
    /// Squared circumradius of a face, and that of the query for corners at rest, m².
    circumradius_squared: f32,
    corner_at_rest_squared: f32,
    /// Time until the next query, s.
    span: f32,
}

impl NearPairSearch<'_> {
    fn surface(&self, garment: u32) -> &SurfaceModel {
        &self.model.garments[garment as usize].self_contact.surface
    }

    /// Corners of a face.
    fn corners(&self, f: NearFace) -> [u32; 3] {
        let first = self.all.first[f.garment() as usize];
        self.surface(f.garment()).faces()[f.face()].map(|c| c + first)
    }

    /// Reach of what closes at this speed.
    fn reach_at(&self, closing: f32) -> f32 {
        (self.reach + closing.max(0.0) * self.span).min(self.farthest)
    }

    fn find_faces(&self, range: Range<usize>, out: &mut ChunkFindings) {
        out.faces.clear();
        out.ends.clear();
        out.pairs.clear();
        for v in range {
            self.faces_of(v, out);
            out.ends.push(out.faces.len() as u32);
        }
    }

    /// Near faces of a vertex and its pairs with them. Of points on edges and corners only the nearest counts.
    fn faces_of(&self, v: usize, out: &mut ChunkFindings) {
        let all = self.all;
        let own = all.owner[v];
        // Intersecting cloth is untangled.
        let intersecting = &self.state.garments[own as usize].intersecting;
        if intersecting
            .binary_search(&(v as u32 - all.first[own as usize]))
            .is_ok()
        {
            return;
        }
        self.candidates(v, &mut out.candidates);
        let mut nearest = (f32::INFINITY, None);
        for near in &out.candidates {
            let corners = self.corners(*near);
            if corners.contains(&(v as u32)) {
                continue;
            }
            let Some((pair, d, weights)) = self.face_pair(v, corners) else {
                continue;
            };
            out.faces.push(*near);
            if d <= SHORTEST {
                continue;
            }
            if weights.iter().all(|w| *w > MIN_WEIGHT) {
                out.pairs.push(pair);
            } else if d < nearest.0
                && !self
                    .surface(near.garment())
                    .is_border_point(near.face() as u32, weights)
            {
                nearest = (d, Some(pair));
            }
        }
        out.pairs.extend(nearest.1);
    }

    /// Faces around the near vertices, each once.
    fn candidates(&self, v: usize, out: &mut Vec<NearFace>) {
        let all = self.all;
        let own = all.owner[v];
        let config = &self.model.config;
        out.clear();
        all.grid.within(&all.x[v], self.corner, |w, square| {
            let w = w as usize;
            if w == v || !self.is_corner_near(v, w, square) {
                return;
            }
            let garment = all.owner[w];
            let is_wanted = if garment == own {
                config.self_collision
            } else {
                config.layers
            };
            if !is_wanted {
                return;
            }
            let first = all.first[garment as usize];
            let around = self.surface(garment).faces_around(w as u32 - first);
            out.extend(around.iter().map(|face| NearFace::new(garment, *face)));
        });
        out.sort_unstable();
        out.dedup();
    }

    /// A face with corner `w`, at this squared distance, m², may be within reach of `v`.
    fn is_corner_near(&self, v: usize, w: usize, square: f32) -> bool {
        if square <= self.corner_at_rest_squared {
            return true;
        }
        let closing = (self.all.velocity[w] - self.all.velocity[v]).norm();
        let reach = self.reach_at(closing);
        square <= reach * reach + self.circumradius_squared
    }

    /// A vertex and a face within reach, their distance, metres, and the weights of the closest point.
    fn face_pair(&self, v: usize, corners: [u32; 3]) -> Option<(NearPair, f32, [f32; 3])> {
        let all = self.all;
        let at = corners.map(|c| all.x[c as usize]);
        let weights = closest_on_triangle(&all.x[v], at);
        let (mut offset, mut velocity) = (-all.x[v].coords, -all.velocity[v]);
        for k in 0..3 {
            offset += at[k].coords * weights[k];
            velocity += all.velocity[corners[k] as usize] * weights[k];
        }
        let d = offset.norm();
        let normal = offset / d.max(SHORTEST);
        if d >= self.farthest || d >= self.reach_at(-normal.dot(&velocity)) {
            return None;
        }
        let pair = NearPair {
            vertices: [v as u32, corners[0], corners[1], corners[2]],
            below: 1,
            normal,
        };
        let is_inside = weights.iter().all(|w| *w > MIN_WEIGHT);
        (is_inside || !self.is_in_one_ring(&pair)).then_some((pair, d, weights))
    }

    fn find_edges(
        &self,
        faces: &[NearFace],
        ends: &[u32],
        range: Range<usize>,
        out: &mut ChunkFindings,
    ) {
        let all = self.all;
        let near = |v: usize| &faces[ends[v] as usize..ends[v + 1] as usize];
        for v in range {
            let own = all.owner[v];
            let first = all.first[own as usize];
            for w in self.surface(own).neighbours(v as u32 - first) {
                let w = (w + first) as usize;
                if w < v || near(v).is_empty() && near(w).is_empty() {
                    continue;
                }
                let edge = [v as u32, w as u32];
                out.edges.clear();
                for f in near(v).iter().chain(near(w)) {
                    let [a, b, c] = self.corners(*f);
                    let sides = [[a, b], [b, c], [c, a]];
                    out.edges.extend(sides.map(|[a, b]| NearEdge::new(a, b)));
                }
                out.edges.sort_unstable();
                out.edges.dedup();
                for other in out.edges.iter().map(|e| e.ends()) {
                    let Some(pair) = self.edge_pair(edge, other) else {
                        continue;
                    };
                    // The smaller edge has found it if an end of the other is near a face of this one.
                    let is_found = || {
                        let mut near = other.iter().flat_map(|c| near(*c as usize));
                        near.any(|f| edge.iter().all(|v| self.corners(*f).contains(v)))
                    };
                    if edge < other || !is_found() {
                        out.pairs.push(pair);
                    }
                }
            }
        }
    }

    /// Two edges within reach whose closest points are no ends.
    fn edge_pair(&self, a: [u32; 2], b: [u32; 2]) -> Option<NearPair> {
        if a.iter().any(|v| b.contains(v)) {
            return None;
        }
        let at = |e: [u32; 2]| e.map(|v| self.all.x[v as usize]);
        let ([s, t], offset) = closest_inside(at(a), at(b))?;
        let d = offset.norm();
        if d >= self.farthest || d <= SHORTEST {
            return None;
        }
        let normal = offset / d;
        let u = &self.all.velocity;
        let of = |e: [u32; 2], w: f32| u[e[0] as usize] * (1.0 - w) + u[e[1] as usize] * w;
        let pair = NearPair {
            vertices: [a[0], a[1], b[0], b[1]],
            below: 2,
            normal,
        };
        let is_near = d < self.reach_at(normal.dot(&(of(a, s) - of(b, t))));
        is_near.then_some(pair)
    }

    /// A vertex is a neighbour of a corner of a face: in a flat sheet their closest points lie on the face's border.
    fn is_in_one_ring(&self, pair: &NearPair) -> bool {
        let all = self.all;
        let [v, corners @ ..] = pair.vertices;
        let own = all.owner[v as usize];
        let first = all.first[own as usize];
        let ring = self.surface(own).neighbours(v - first);
        own == all.owner[corners[0] as usize] && corners.iter().any(|c| ring.contains(&(c - first)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    #[test]
    fn closest_points_inside_two_edges_are_nearer_than_all_others() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(5);
        let mut point = || {
            P3::from(std::array::from_fn::<f32, 3, _>(|_| {
                rng.random_range(-1.0f32..1.0)
            }))
        };
        let mut inside = 0;
        for _ in 0..200 {
            let (a, b) = ([point(), point()], [point(), point()]);
            let at = |e: [P3; 2], t: f32| e[0] + (e[1] - e[0]) * t;
            let shares = || (0..=20).map(|k| k as f32 / 20.0);
            let sampled =
                shares().flat_map(|s| shares().map(move |t| (at(a, s) - at(b, t)).norm()));
            let sampled = sampled.fold(f32::INFINITY, f32::min);
            let Some(([s, t], offset)) = closest_inside(a, b) else {
                continue;
            };
            inside += 1;
            assert!((at(a, s) + offset - at(b, t)).norm() < 1e-5);
            assert!(
                offset.norm() < sampled + 1e-5,
                "{} {sampled}",
                offset.norm()
            );
        }
        assert!(inside > 20, "{inside}");
        let x = |y: f32, z: f32| [P3::new(-1.0, y, z), P3::new(1.0, y, z)];
        assert_eq!(closest_inside(x(0.0, 0.0), x(0.1, 0.0)), None, "parallel");
        assert_eq!(
            closest_inside([P3::origin(); 2], x(0.1, 0.0)),
            None,
            "a point"
        );
    }
}
