//! Near pairs of features of an outfit: vertices and faces, edges and edges, of two garments or of folds of one.

use crate::cloth::outfit_model::Model;
use crate::cloth::patch::PatchWork;
use crate::cloth::state::State;
use crate::contact::{SurfaceFrame, SurfaceModel};
use crate::math::{P3, V3};
use crate::par::{self, Par};
use crate::spatial::{HashGrid, closest_on_triangle};
use std::ops::Range;

/// Vertices that one thread queries in a row.
const CHUNK: usize = 256;
/// Largest distance of pairs at rest, in edge lengths: with 0.4 a dance has four times the crossings.
const REACH_EDGES: f32 = 0.5;
/// Largest distance of pairs that close fast, metres: folds meet at 1 m/s in an interval of 8 ms.
const FARTHEST: f32 = 0.015;
/// Shortest distance that has a direction, metres.
const SHORTEST: f32 = 1e-5;
/// A corner with less barycentric weight has no part in a point.
const MIN_WEIGHT: f32 = 1e-4;
/// Least squared sine of the angle between two edges of a pair: parallel ones are met by their ends.
const MIN_SINE_SQUARED: f32 = 1e-3;

/// Two features. The first `below` vertices belong to the one, the others to the other, to which `normal` points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pair {
    pub(super) vertices: [u32; 4],
    pub(super) below: usize,
    /// Unit direction of the closest points.
    pub(super) normal: V3,
}

impl Pair {
    /// Direction from the other feature to that of vertex `i` of the pair.
    pub(super) fn outward(&self, i: usize) -> V3 {
        if i < self.below {
            -self.normal
        } else {
            self.normal
        }
    }
}

/// Face of a garment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct NearFace {
    garment: u32,
    face: u32,
}

/// What one chunk of vertices finds.
#[derive(Debug, Default)]
struct Found {
    /// Near faces, vertex by vertex, and the end of those of each vertex.
    faces: Vec<NearFace>,
    ends: Vec<u32>,
    pairs: Vec<Pair>,
    /// Scratch.
    candidates: Vec<NearFace>,
    edges: Vec<[u32; 2]>,
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
    /// Each garment with normals.
    frames: Vec<SurfaceFrame>,
    grid: HashGrid,
    found: Vec<Found>,
    faces: Vec<NearFace>,
    ends: Vec<u32>,
    pub(super) pairs: Vec<Pair>,
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

    /// Finds the pairs that may touch within `span` seconds.
    pub(super) fn find(&mut self, model: &Model, state: &State, span: f32) {
        let par = model.config.par;
        self.update_frames(model);
        let edges = model.garments.iter().map(|g| g.self_contact.edge());
        let edge = edges.fold(0.0, f32::max);
        let reach = REACH_EDGES * edge;
        let farthest = reach.max(FARTHEST);
        // A corner of an equilateral triangle is at most its circumradius beside the closest point.
        let corner = farthest.hypot(edge / 3f32.sqrt());
        self.grid.fill(&self.x, 2.0 * corner);

        let n = self.x.len();
        let mut found = std::mem::take(&mut self.found);
        found.resize_with(n.div_ceil(CHUNK), Found::default);
        let range = |k: usize| k * CHUNK..((k + 1) * CHUNK).min(n);
        let search = Search {
            model,
            state,
            all: self,
            reach,
            farthest,
            corner,
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

    fn update_frames(&mut self, model: &Model) {
        self.frames
            .resize_with(model.garments.len(), SurfaceFrame::default);
        let (first, x) = (&self.first, &self.x);
        par::for_chunks(model.config.par, &mut self.frames, 1, |k, frame| {
            let frame = &mut frame[0];
            frame.vertices.clear();
            frame
                .vertices
                .extend_from_slice(&x[first[k] as usize..first[k + 1] as usize]);
            let surface = &model.garments[k].self_contact.surface;
            surface.update_normals(Par::Seq, frame);
        });
    }
}

/// Near faces of all vertices, and the end of those of each, the first end being 0.
fn join(found: &[Found]) -> (Vec<NearFace>, Vec<u32>) {
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
struct Search<'a> {
    model: &'a Model,
    state: &'a State,
    all: &'a NearPairs,
    /// Reach at rest and at most, and that of the query for corners, metres.
    reach: f32,
    farthest: f32,
    corner: f32,
    /// Time until the next query, s.
    span: f32,
}

impl Search<'_> {
    fn surface(&self, garment: u32) -> &SurfaceModel {
        &self.model.garments[garment as usize].self_contact.surface
    }

    /// Reach of what closes at this speed.
    fn reach_at(&self, closing: f32) -> f32 {
        (self.reach + closing.max(0.0) * self.span).min(self.farthest)
    }

    fn find_faces(&self, range: Range<usize>, out: &mut Found) {
        out.faces.clear();
        out.ends.clear();
        out.pairs.clear();
        for v in range {
            self.faces_of(v, out);
            out.ends.push(out.faces.len() as u32);
        }
    }

    /// Near faces of a vertex and its pairs with them. Of points on edges and corners only the nearest counts.
    fn faces_of(&self, v: usize, out: &mut Found) {
        let all = self.all;
        let own = all.owner[v];
        // What intersects is untangled.
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
            let surface = self.surface(near.garment);
            let first = all.first[near.garment as usize];
            let corners = surface.faces()[near.face as usize].map(|c| c + first);
            let Some((pair, d, weights)) = self.face_pair(v, corners) else {
                continue;
            };
            out.faces.push(*near);
            if d <= SHORTEST {
                continue;
            }
            if weights.iter().all(|w| *w > MIN_WEIGHT) {
                out.pairs.push(pair);
            } else if d < nearest.0 && !surface.is_border_point(near.face, weights) {
                nearest = (d, Some(pair));
            }
        }
        out.pairs.extend(nearest.1);
    }

    /// Faces around the near vertices that are no neighbours, in order.
    fn candidates(&self, v: usize, out: &mut Vec<NearFace>) {
        let all = self.all;
        let own = all.owner[v];
        let first = all.first[own as usize];
        let ring = self.surface(own).neighbours(v as u32 - first);
        let config = &self.model.config;
        out.clear();
        all.grid.within(&all.x[v], self.corner, |w, _| {
            let garment = all.owner[w as usize];
            let is_same = garment == own;
            if is_same && (w as usize == v || ring.contains(&(w - first))) {
                return;
            }
            let is_wanted = if is_same {
                config.self_collision
            } else {
                config.layers
            };
            if is_wanted {
                let around = self
                    .surface(garment)
                    .faces_around(w - all.first[garment as usize]);
                out.extend(around.iter().map(|face| NearFace {
                    garment,
                    face: *face,
                }));
            }
        });
        out.sort_unstable();
        out.dedup();
    }

    /// A vertex and a face within reach, their distance, metres, and the weights of the closest point.
    fn face_pair(&self, v: usize, corners: [u32; 3]) -> Option<(Pair, f32, [f32; 3])> {
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
        let pair = Pair {
            vertices: [v as u32, corners[0], corners[1], corners[2]],
            below: 1,
            normal,
        };
        (!self.is_flat(&pair)).then_some((pair, d, weights))
    }

    fn find_edges(&self, faces: &[NearFace], ends: &[u32], range: Range<usize>, out: &mut Found) {
        let all = self.all;
        let near = |v: usize| &faces[ends[v] as usize..ends[v + 1] as usize];
        for v in range {
            let own = all.owner[v];
            let first = all.first[own as usize];
            for w in self.surface(own).neighbours(v as u32 - first) {
                let w = (w + first) as usize;
                if w < v {
                    continue;
                }
                out.edges.clear();
                for f in near(v).iter().chain(near(w)) {
                    let base = all.first[f.garment as usize];
                    let c = self.surface(f.garment).faces()[f.face as usize].map(|c| c + base);
                    let sides = [[c[0], c[1]], [c[1], c[2]], [c[2], c[0]]];
                    out.edges.extend(sides.map(|[a, b]| [a.min(b), a.max(b)]));
                }
                out.edges.sort_unstable();
                out.edges.dedup();
                let pairs = out
                    .edges
                    .iter()
                    .filter_map(|e| self.edge_pair([v as u32, w as u32], *e));
                out.pairs.extend(pairs);
            }
        }
    }

    /// Two edges within reach whose closest points are no ends.
    fn edge_pair(&self, a: [u32; 2], b: [u32; 2]) -> Option<Pair> {
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
        let pair = Pair {
            vertices: [a[0], a[1], b[0], b[1]],
            below: 2,
            normal,
        };
        let is_near = d < self.reach_at(normal.dot(&(of(a, s) - of(b, t))));
        (is_near && !self.is_flat(&pair)).then_some(pair)
    }

    /// Both features lie in one ring that is not folded, or have a common vertex.
    fn is_flat(&self, pair: &Pair) -> bool {
        let all = self.all;
        let (a, b) = pair.vertices.split_at(pair.below);
        let own = all.owner[a[0] as usize];
        if own != all.owner[b[0] as usize] {
            return false;
        }
        let first = all.first[own as usize];
        let is_near = |v: &u32| {
            let ring = self.surface(own).neighbours(v - first);
            b.iter().any(|w| w == v || ring.contains(&(w - first)))
        };
        let normals = &all.frames[own as usize].normals;
        let sum = |of: &[u32]| {
            let normal = |v: &u32| normals[(v - first) as usize];
            of.iter().map(normal).sum::<V3>()
        };
        a.iter().any(|v| b.contains(v)) || a.iter().any(is_near) && sum(a).dot(&sum(b)) >= 0.0
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
