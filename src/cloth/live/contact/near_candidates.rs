//! Candidates for near pairs: features of cloth that may come within reach of each other before the next query.
//!
//! Most cloth is near no other sheet: where a garment is not folded, its vertices have none of the faces within two rings.

use super::outfit_vertices::{OutfitVertices, surface};
use super::pair_reach::{PairReach, longest_edge};
use crate::contact::{LANES, TriangleFan};
use crate::live::outfit_model::Model;
use crate::live::state::State;
use crate::settings::NearPairSettings;
use std::ops::Range;
use tryon_geometry::math::V3;
use tryon_geometry::par;
use tryon_geometry::spatial::HashGrid;

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
    /// Cosine of the sharpest angle between a vertex' normal and the faces around it.
    flatness: Vec<f32>,
    grid: HashGrid,
    found: Vec<ChunkFindings>,
}

/// Findings of one chunk of vertices.
#[derive(Debug, Default)]
struct ChunkFindings {
    faces: Vec<FaceCandidate>,
    /// Scratch: near faces by garment and face; for each vertex the last one that it is within two rings of; for each face
    /// the last vertex that has met it.
    near: Vec<(u32, u32)>,
    ring_of: Vec<u32>,
    face_met: Vec<u32>,
}

impl NearCandidates {
    /// Finds what may touch within `span` seconds.
    pub(super) fn find(&mut self, model: &Model, state: &State, all: &OutfitVertices, span: f32) {
        let settings = &model.config.contact.pairs;
        let limits = [settings.farthest_candidate, settings.slack];
        let reach = PairReach::new(model, limits, span);
        let circumradius_squared = longest_edge(model).powi(2) / 3.0;
        let corner = (reach.farthest * reach.farthest + circumradius_squared).sqrt();
        self.grid.fill(&all.x, 2.0 * corner);
        self.measure_flatness(model, all);

        let n = all.len();
        let mut found = std::mem::take(&mut self.found);
        found.resize_with(PIECES, ChunkFindings::default);
        let range = |k: usize, of: usize| k * of / PIECES..(k + 1) * of / PIECES;
        let search = CandidateSearch {
            face_numbers: face_numbers(model),
            model,
            state,
            all,
            grid: &self.grid,
            flatness: &self.flatness,
            settings,
            reach,
            corner,
            circumradius_squared,
        };
        let par = model.config.par;
        par::for_chunks(par, &mut found, 1, |k, f| {
            search.find_faces(range(k, n), &mut f[0])
        });
        self.faces.clear();
        for f in &found {
            self.faces.extend_from_slice(&f.faces);
        }
        self.found = found;
    }

    /// No cloth is near cloth.
    pub(super) fn is_empty(&self) -> bool {
        self.faces.is_empty()
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

/// First number of each garment's faces, numbered through, and the end.
fn face_numbers(model: &Model) -> Vec<u32> {
    let mut first = vec![0];
    for g in &model.garments {
        let last = first.last().copied().unwrap_or(0);
        first.push(last + g.topology.surface.faces().len() as u32);
    }
    first
}

/// One query.
struct CandidateSearch<'a> {
    face_numbers: Vec<u32>,
    model: &'a Model,
    state: &'a State,
    all: &'a OutfitVertices,
    grid: &'a HashGrid,
    flatness: &'a [f32],
    settings: &'a NearPairSettings,
    reach: PairReach,
    /// Reach of the query for corners, metres.
    corner: f32,
    /// Squared circumradius of a face, m².
    circumradius_squared: f32,
}

impl CandidateSearch<'_> {
    fn find_faces(&self, range: Range<usize>, out: &mut ChunkFindings) {
        out.faces.clear();
        for (met, n) in [
            (&mut out.ring_of, self.all.len()),
            (
                &mut out.face_met,
                self.face_numbers.last().map_or(0, |n| *n as usize),
            ),
        ] {
            met.clear();
            met.resize(n, u32::MAX);
        }
        for v in range {
            self.faces_of(v as u32, out);
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
        let at = |c: u32| all.x[c as usize];
        for some in out.near.chunks(LANES) {
            let corners = |(garment, face): &(u32, u32)| all.corners(self.model, *garment, *face);
            let triangles = some.iter().map(|f| corners(f).map(at));
            let (weights, squares) = TriangleFan::new(&at(v), triangles).closest();
            for (lane, f) in some.iter().enumerate() {
                let corners = corners(f);
                let weights = [weights[0][lane], weights[1][lane]];
                let (garment, face) = *f;
                if corners.contains(&v) || !self.is_near(v, corners, weights, squares[lane]) {
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
    }

    /// Faces around the near vertices, each once.
    fn near_faces(&self, v: u32, out: &mut ChunkFindings) {
        let (all, config) = (self.all, &self.model.config);
        let own = all.garment_of(v);
        let is_flat = self.is_flat(v);
        if is_flat && config.self_collision {
            let g = &self.model.garments[own as usize].topology;
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
            let first = self.face_numbers[garment as usize];
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
        let reach = self.reach.at(closing);
        square <= reach * reach + self.circumradius_squared
    }

    /// The closest point of a face, by the weights of its second and third corner, may come within reach of a vertex from
    /// this squared distance, m².
    fn is_near(&self, v: u32, corners: [u32; 3], [p, q]: [f32; 2], square: f32) -> bool {
        if square >= self.reach.farthest * self.reach.farthest {
            return false;
        }
        let velocity = |v: u32| self.all.velocity[v as usize];
        let of_face = corners.map(velocity);
        let speed = of_face[0] * (1.0 - p - q) + of_face[1] * p + of_face[2] * q - velocity(v);
        let reach = self.reach.at(speed.norm());
        square < reach * reach
    }
}
