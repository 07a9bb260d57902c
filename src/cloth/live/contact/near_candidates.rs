//! Candidates for near pairs: features of cloth that may come within reach of each other before the next query.
//!
//! Most cloth is near no other sheet: where a garment is not folded, its vertices have none of the faces within two rings.

use super::outfit_vertices::{OutfitVertices, surface};
use crate::live::outfit_model::Model;
use crate::live::state::State;
use crate::settings::NearPairSettings;
use std::ops::Range;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par;
use tryon_geometry::spatial::{HashGrid, closest_on_triangle};

/// Pieces of the query that threads share; each has a mark for every feature.
const PIECES: usize = 8;

/// A vertex and a face that may meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct FaceCandidate {
    pub(super) vertex: u32,
    pub(super) corners: [u32; 3],
    /// The face and the garment that it belongs to.
    pub(super) face: u32,
    pub(super) garment: u32,
    /// A corner is a neighbour of the vertex.
    pub(super) is_in_one_ring: bool,
}

/// Candidates of an outfit.
#[derive(Debug, Default)]
pub(super) struct NearCandidates {
    /// Vertex by vertex.
    pub(super) faces: Vec<FaceCandidate>,
    /// Two edges without a common end, each pair once.
    pub(super) edges: Vec<[[u32; 2]; 2]>,
    /// End of the faces of each vertex; the first is 0.
    ends: Vec<u32>,
    /// Cosine of the sharpest angle between a vertex' normal and the faces around it.
    flatness: Vec<f32>,
    grid: HashGrid,
    found: Vec<ChunkFindings>,
}

/// Findings of one chunk of vertices.
#[derive(Debug, Default)]
struct ChunkFindings {
    faces: Vec<FaceCandidate>,
    /// End of the faces of each vertex.
    ends: Vec<u32>,
    edges: Vec<[[u32; 2]; 2]>,
    /// Scratch: near faces by garment and face; for each vertex the last one that it is within two rings of; for each face
    /// the last vertex, and for each edge the last edge, that has met it.
    near: Vec<(u32, u32)>,
    ring_of: Vec<u32>,
    face_met: Vec<u32>,
    edge_met: Vec<u32>,
}

impl NearCandidates {
    /// Finds what may touch within `span` seconds.
    pub(super) fn find(&mut self, model: &Model, state: &State, all: &OutfitVertices, span: f32) {
        let settings = &model.config.contact.pairs;
        let edges = model.garments.iter().map(|g| g.self_contact.edge());
        let edge = edges.fold(0.0, f32::max);
        let reach = settings.reach_edges * edge;
        let farthest = settings.farthest_candidate.max(reach);
        let circumradius_squared = edge * edge / 3.0;
        let corner = (farthest * farthest + circumradius_squared).sqrt();
        self.grid.fill(&all.x, 2.0 * corner);
        self.measure_flatness(model, all);

        let n = all.len();
        let mut found = std::mem::take(&mut self.found);
        found.resize_with(PIECES, ChunkFindings::default);
        let range = |k: usize, of: usize| k * of / PIECES..(k + 1) * of / PIECES;
        let search = CandidateSearch {
            numbers: FeatureNumbers::new(model),
            model,
            state,
            all,
            grid: &self.grid,
            flatness: &self.flatness,
            settings,
            reach,
            farthest,
            corner,
            circumradius_squared,
            span,
        };
        let par = model.config.par;
        par::for_chunks(par, &mut found, 1, |k, f| {
            search.find_faces(range(k, n), &mut f[0])
        });
        self.faces.clear();
        self.ends.clear();
        self.ends.push(0);
        for f in &found {
            let base = self.faces.len() as u32;
            self.faces.extend_from_slice(&f.faces);
            self.ends.extend(f.ends.iter().map(|e| base + e));
        }
        let near = NearFaces {
            faces: &self.faces,
            ends: &self.ends,
        };
        let edges = search.numbers.edges.last().copied().unwrap_or(0) as usize;
        par::for_chunks(par, &mut found, 1, |k, f| {
            search.find_edges(near, range(k, edges), &mut f[0]);
        });
        self.edges.clear();
        for f in &found {
            self.edges.extend_from_slice(&f.edges);
        }
        self.found = found;
    }

    /// No cloth is near cloth.
    pub(super) fn is_empty(&self) -> bool {
        self.faces.is_empty() && self.edges.is_empty()
    }

    fn measure_flatness(&mut self, model: &Model, all: &OutfitVertices) {
        par::map_into(model.config.par, all.len(), 1024, &mut self.flatness, |v| {
            let garment = all.garment_of(v as u32);
            let around = surface(model, garment).faces_around(v as u32 - all.first(garment));
            let normal = |face: &u32| {
                let [a, b, c] = all
                    .corners(model, garment, *face)
                    .map(|c| all.x[c as usize]);
                (b - a).cross(&(c - a))
            };
            let mean: V3 = around.iter().map(normal).sum();
            let square = mean.norm_squared();
            let cosine = |face: &u32| {
                let n = normal(face);
                n.dot(&mean) / (n.norm_squared() * square).sqrt().max(f32::MIN_POSITIVE)
            };
            around.iter().map(cosine).fold(1.0, f32::min)
        });
    }
}

/// Near faces by vertex.
#[derive(Clone, Copy)]
struct NearFaces<'a> {
    faces: &'a [FaceCandidate],
    ends: &'a [u32],
}

impl<'a> NearFaces<'a> {
    fn of(&self, v: u32) -> &'a [FaceCandidate] {
        let v = v as usize;
        &self.faces[self.ends[v] as usize..self.ends[v + 1] as usize]
    }
}

/// First number of each garment's faces and edges, numbered through, and the ends.
struct FeatureNumbers {
    faces: Vec<u32>,
    edges: Vec<u32>,
}

impl FeatureNumbers {
    fn new(model: &Model) -> Self {
        let (mut faces, mut edges) = (vec![0], vec![0]);
        let (mut face, mut edge) = (0, 0);
        for g in model.garments.iter().map(|g| &g.self_contact) {
            face += g.face_edges.len() as u32;
            edge += g.edges.len() as u32;
            faces.push(face);
            edges.push(edge);
        }
        Self { faces, edges }
    }

    fn edge(&self, garment: u32, edge: u32) -> u32 {
        self.edges[garment as usize] + edge
    }

    /// Garment of an edge.
    fn garment_of_edge(&self, edge: u32) -> u32 {
        self.edges.partition_point(|first| *first <= edge) as u32 - 1
    }
}

/// One query.
struct CandidateSearch<'a> {
    numbers: FeatureNumbers,
    model: &'a Model,
    state: &'a State,
    all: &'a OutfitVertices,
    grid: &'a HashGrid,
    flatness: &'a [f32],
    settings: &'a NearPairSettings,
    /// Reach at rest and at most, and that of the query for corners, metres.
    reach: f32,
    farthest: f32,
    corner: f32,
    /// Squared circumradius of a face, m².
    circumradius_squared: f32,
    /// Time until the next query, s.
    span: f32,
}

impl CandidateSearch<'_> {
    /// Reach of what closes at this speed, metres.
    fn reach_at(&self, closing: f32) -> f32 {
        let motion = closing.max(0.0) * self.span + self.settings.slack;
        (self.reach + motion).min(self.farthest)
    }

    fn find_faces(&self, range: Range<usize>, out: &mut ChunkFindings) {
        out.faces.clear();
        out.ends.clear();
        for (met, n) in [
            (&mut out.ring_of, self.all.len()),
            (
                &mut out.face_met,
                self.numbers.faces.last().map_or(0, |n| *n as usize),
            ),
        ] {
            met.clear();
            met.resize(n, u32::MAX);
        }
        for v in range {
            self.faces_of(v as u32, out);
            out.ends.push(out.faces.len() as u32);
        }
    }

    fn faces_of(&self, v: u32, out: &mut ChunkFindings) {
        let all = self.all;
        let own = all.garment_of(v);
        // Intersecting cloth is untangled.
        let intersecting = &self.state.garments[own as usize].intersecting;
        if intersecting.binary_search(&(v - all.first(own))).is_ok() {
            return;
        }
        self.near_faces(v, out);
        let ring = surface(self.model, own).neighbours(v - all.first(own));
        for &(garment, face) in &out.near {
            let corners = all.corners(self.model, garment, face);
            if corners.contains(&v) || !self.is_near(v, corners) {
                continue;
            }
            let is_neighbour = |c: &u32| ring.contains(&(c - all.first(own)));
            out.faces.push(FaceCandidate {
                vertex: v,
                corners,
                face,
                garment,
                is_in_one_ring: garment == own && corners.iter().any(is_neighbour),
            });
        }
    }

    /// Faces around the near vertices, each once.
    fn near_faces(&self, v: u32, out: &mut ChunkFindings) {
        let (all, config) = (self.all, &self.model.config);
        let own = all.garment_of(v);
        let is_flat = self.is_flat(v);
        if is_flat && config.self_collision {
            let g = &self.model.garments[own as usize].self_contact;
            let first = all.first(own);
            for w in g.within_two_rings(v - first) {
                out.ring_of[(w + first) as usize] = v;
            }
        }
        let (near, ring_of, met) = (&mut out.near, &out.ring_of, &mut out.face_met);
        near.clear();
        let x = &all.x[v as usize];
        self.grid.within(x, self.corner, |w, square| {
            let garment = all.garment_of(w);
            let is_wanted = if garment == own {
                config.self_collision && w != v && !(is_flat && ring_of[w as usize] == v)
            } else {
                config.layers
            };
            if !is_wanted || !self.is_corner_near(v, w, square) {
                return;
            }
            let around = surface(self.model, garment).faces_around(w - all.first(garment));
            let first = self.numbers.faces[garment as usize];
            for face in around {
                if std::mem::replace(&mut met[(first + face) as usize], v) != v {
                    near.push((garment, *face));
                }
            }
        });
    }

    /// No face within two rings of the vertex can fold back onto it.
    fn is_flat(&self, v: u32) -> bool {
        let flat = |w: u32| self.flatness[w as usize] > self.settings.flat;
        flat(v) && self.all.neighbours(self.model, v).all(flat)
    }

    /// A face with corner `w`, at this squared distance, m², may be within reach of `v`.
    fn is_corner_near(&self, v: u32, w: u32, square: f32) -> bool {
        let velocity = &self.all.velocity;
        let closing = (velocity[w as usize] - velocity[v as usize]).norm();
        let reach = self.reach_at(closing);
        square <= reach * reach + self.circumradius_squared
    }

    fn is_near(&self, v: u32, corners: [u32; 3]) -> bool {
        let (x, velocity) = (&self.all.x, &self.all.velocity);
        let p = &x[v as usize];
        let weights = closest_on_triangle(p, corners.map(|c| x[c as usize]));
        let (mut offset, mut speed) = (-p.coords, -velocity[v as usize]);
        for k in 0..3 {
            let c = corners[k] as usize;
            offset += x[c].coords * weights[k];
            speed += velocity[c] * weights[k];
        }
        let reach = self.reach_at(speed.norm());
        offset.norm_squared() < reach * reach
    }

    /// Pairs of the edges in a range with others.
    fn find_edges(&self, near: NearFaces<'_>, range: Range<usize>, out: &mut ChunkFindings) {
        out.edges.clear();
        out.edge_met.clear();
        out.edge_met.resize(
            self.numbers.edges.last().map_or(0, |n| *n as usize),
            u32::MAX,
        );
        for number in range.map(|n| n as u32) {
            let garment = self.numbers.garment_of_edge(number);
            let edge = self.ends(garment, number - self.numbers.edges[garment as usize]);
            if edge.iter().all(|v| near.of(*v).is_empty()) {
                continue;
            }
            for f in edge.iter().flat_map(|v| near.of(*v)) {
                let g = &self.model.garments[f.garment as usize].self_contact;
                for e in g.face_edges[f.face as usize] {
                    let other = self.numbers.edge(f.garment, e);
                    if std::mem::replace(&mut out.edge_met[other as usize], number) == number {
                        continue;
                    }
                    let ends = self.ends(f.garment, e);
                    if ends.iter().any(|v| edge.contains(v)) || !self.are_near(edge, ends) {
                        continue;
                    }
                    // The smaller edge has found it if an end of the other is near a face of this one.
                    let is_found = || {
                        let mut near = ends.iter().flat_map(|c| near.of(*c));
                        near.any(|f| edge.iter().all(|v| f.corners.contains(v)))
                    };
                    if number < other || !is_found() {
                        out.edges.push([edge, ends]);
                    }
                }
            }
        }
    }

    /// Numbers of the ends of an edge.
    fn ends(&self, garment: u32, edge: u32) -> [u32; 2] {
        let first = self.all.first(garment);
        self.model.garments[garment as usize].self_contact.edges[edge as usize].map(|v| v + first)
    }

    fn are_near(&self, a: [u32; 2], b: [u32; 2]) -> bool {
        let (x, velocity) = (&self.all.x, &self.all.velocity);
        let at = |e: [u32; 2]| e.map(|v| x[v as usize]);
        let mean = |e: [u32; 2]| velocity[e[0] as usize] + velocity[e[1] as usize];
        let reach = self.reach_at(0.5 * (mean(a) - mean(b)).norm());
        square_distance(at(a), at(b)) < reach * reach
    }
}

/// Squared distance of two segments, m²: of the ends of each from the other, and of the lines where they pass inside both.
fn square_distance(a: [P3; 2], b: [P3; 2]) -> f32 {
    let from_segment = |p: P3, [from, to]: [P3; 2]| {
        let way = to - from;
        let t = (p - from).dot(&way) / way.norm_squared().max(f32::MIN_POSITIVE);
        (p - (from + way * t.clamp(0.0, 1.0))).norm_squared()
    };
    let ends = [
        from_segment(a[0], b),
        from_segment(a[1], b),
        from_segment(b[0], a),
        from_segment(b[1], a),
    ];
    let ends = ends.into_iter().fold(f32::INFINITY, f32::min);
    let normal = (a[1] - a[0]).cross(&(b[1] - b[0]));
    let square = normal.norm_squared();
    if square <= f32::MIN_POSITIVE {
        return ends;
    }
    // The common perpendicular meets both inside exactly where each separates the other's ends.
    let side = |p: P3, [from, to]: [P3; 2]| (to - from).cross(&(p - from)).dot(&normal);
    let is_inside = side(b[0], a) * side(b[1], a) < 0.0 && side(a[0], b) * side(a[1], b) < 0.0;
    if is_inside {
        let height = (b[0] - a[0]).dot(&normal);
        height * height / square
    } else {
        ends
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    #[test]
    fn distances_of_segments_are_those_of_their_nearest_samples() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(5);
        let mut point = || {
            P3::from(std::array::from_fn::<f32, 3, _>(|_| {
                rng.random_range(-1.0..1.0)
            }))
        };
        for _ in 0..200 {
            let (a, b) = ([point(), point()], [point(), point()]);
            let at = |e: [P3; 2], t: f32| e[0] + (e[1] - e[0]) * t;
            let shares = || (0..=100).map(|k| k as f32 / 100.0);
            let sampled =
                shares().flat_map(|s| shares().map(move |t| (at(a, s) - at(b, t)).norm()));
            let sampled = sampled.fold(f32::INFINITY, f32::min);
            let exact = square_distance(a, b).sqrt();
            assert!(
                exact < sampled + 1e-5 && sampled < exact + 0.02,
                "{exact} {sampled}"
            );
        }
    }
}
