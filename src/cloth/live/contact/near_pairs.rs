//! Near pairs of features of an outfit: vertices and faces, edges and edges, of two garments or of folds of one.

use super::near_candidates::{FaceCandidate, NearCandidates};
use super::outfit_vertices::{OutfitVertices, surface};
use super::pair_reach::PairReach;
use crate::contact::{LANES, TriangleFan};
use crate::live::outfit_model::Model;
use crate::settings::NearPairSettings;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par;

/// Pieces of the edges that threads share; each has a mark for every edge.
const PIECES: usize = 8;
/// Vertices whose candidates one thread looks at in a row.
const BLOCK: u32 = 64;

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

/// Pairs within reach.
#[derive(Debug, Default)]
pub(super) struct NearPairs {
    pub(super) pairs: Vec<NearPair>,
    /// Vertices and faces within reach, those of each vertex together, and the first and last but one of each.
    near: Vec<FaceCandidate>,
    of_vertex: Vec<[u32; 2]>,
    of_faces: Vec<FaceFindings>,
    of_edges: Vec<EdgeFindings>,
}

/// Findings among some candidates.
#[derive(Debug, Default)]
struct FaceFindings {
    pairs: Vec<NearPair>,
    near: Vec<FaceCandidate>,
}

/// Findings of some edges.
#[derive(Debug, Default)]
struct EdgeFindings {
    pairs: Vec<NearPair>,
    /// Scratch: for each edge the last one that has met it.
    met: Vec<u32>,
}

impl NearPairs {
    /// Finds the pairs among some candidates that may touch within `span` seconds.
    pub(super) fn find(
        &mut self,
        model: &Model,
        all: &OutfitVertices,
        candidates: &NearCandidates,
        span: f32,
    ) {
        let settings = &model.config.contact.pairs;
        let search = NearPairSearch {
            model,
            all,
            settings,
            reach: PairReach::new(model, [settings.farthest, 0.0], span),
        };
        self.find_faces(&search, candidates);
        self.find_edges(&search);
        self.pairs.clear();
        for found in &self.of_faces {
            self.pairs.extend_from_slice(&found.pairs);
        }
        for found in &self.of_edges {
            self.pairs.extend_from_slice(&found.pairs);
        }
    }

    fn find_faces(&mut self, search: &NearPairSearch<'_>, candidates: &NearCandidates) {
        // A vertex' candidates stay together.
        let of_vertices: Vec<&[FaceCandidate]> = candidates
            .faces
            .chunk_by(|a, b| a.vertex / BLOCK == b.vertex / BLOCK)
            .collect();
        self.of_faces
            .resize_with(of_vertices.len(), FaceFindings::default);
        par::for_chunks(search.model.config.par, &mut self.of_faces, 1, |k, out| {
            let out = &mut out[0];
            out.pairs.clear();
            out.near.clear();
            for own in of_vertices[k].chunk_by(|a, b| a.vertex == b.vertex) {
                search.pairs_with_faces(own, out);
            }
        });
        self.near.clear();
        for found in &self.of_faces {
            self.near.extend_from_slice(&found.near);
        }
        self.of_vertex.clear();
        self.of_vertex.resize(search.all.len(), [0; 2]);
        let mut from = 0;
        for own in self.near.chunk_by(|a, b| a.vertex == b.vertex) {
            let to = from + own.len() as u32;
            self.of_vertex[own[0].vertex as usize] = [from, to];
            from = to;
        }
    }

    /// Edges of near faces: where two edges are near, an end of the one is near a face of the other.
    fn find_edges(&mut self, search: &NearPairSearch<'_>) {
        let numbers = EdgeNumbers::new(search.model);
        let near = NearFaces {
            faces: &self.near,
            of_vertex: &self.of_vertex,
        };
        self.of_edges.resize_with(PIECES, EdgeFindings::default);
        par::for_chunks(search.model.config.par, &mut self.of_edges, 1, |k, out| {
            let range = |k: usize| (k * numbers.end() / PIECES) as u32;
            for of in &mut *out {
                of.met.clear();
                of.met.resize(numbers.end(), u32::MAX);
                of.pairs.clear();
            }
            for edge in range(k)..range(k + 1) {
                search.pairs_of_edge(&numbers, near, edge, &mut out[0]);
            }
        });
    }
}

/// Near faces by vertex.
#[derive(Clone, Copy)]
struct NearFaces<'a> {
    faces: &'a [FaceCandidate],
    of_vertex: &'a [[u32; 2]],
}

impl<'a> NearFaces<'a> {
    fn of(&self, v: u32) -> &'a [FaceCandidate] {
        let [from, to] = self.of_vertex[v as usize];
        &self.faces[from as usize..to as usize]
    }
}

/// First number of each garment's edges, numbered through, and the end.
struct EdgeNumbers(Vec<u32>);

impl EdgeNumbers {
    fn new(model: &Model) -> Self {
        let mut first = vec![0];
        for g in &model.garments {
            let last = first.last().copied().unwrap_or(0);
            first.push(last + g.topology.edges.len() as u32);
        }
        Self(first)
    }

    fn of(&self, garment: u32, edge: u32) -> u32 {
        self.0[garment as usize] + edge
    }

    /// Garment of an edge and its number there.
    fn in_garment(&self, edge: u32) -> [u32; 2] {
        let garment = self.0.partition_point(|first| *first <= edge) - 1;
        [garment as u32, edge - self.0[garment]]
    }

    fn end(&self) -> usize {
        self.0.last().map_or(0, |end| *end as usize)
    }
}

/// Closest points of two edges if neither is an end: shares of the way along each, and the offset from the first to the
/// second, metres.
fn closest_inside(a: [P3; 2], b: [P3; 2], min_sine_squared: f32) -> Option<([f32; 2], V3)> {
    let (along_a, along_b, apart) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let (aa, bb) = (along_a.norm_squared(), along_b.norm_squared());
    let ab = along_a.dot(&along_b);
    let (pa, pb) = (along_a.dot(&apart), along_b.dot(&apart));
    let area = aa * bb - ab * ab;
    let (s, t) = (ab * pb - pa * bb, aa * pb - ab * pa);
    let is_inside = s > 0.0 && s < area && t > 0.0 && t < area;
    if !is_inside || area < min_sine_squared * aa * bb {
        return None;
    }
    let (s, t) = (s / area, t / area);
    Some(([s, t], along_b * t - along_a * s - apart))
}

/// One query.
struct NearPairSearch<'a> {
    model: &'a Model,
    all: &'a OutfitVertices,
    settings: &'a NearPairSettings,
    reach: PairReach,
}

impl NearPairSearch<'_> {
    /// Pairs of one vertex with faces. Of points on edges and corners only the nearest counts.
    fn pairs_with_faces(&self, own: &[FaceCandidate], out: &mut FaceFindings) {
        let mut nearest = (f32::INFINITY, None);
        let at = |c: u32| self.all.x[c as usize];
        for some in own.chunks(LANES) {
            let triangles = some.iter().map(|c| c.corners.map(at));
            let ([p, q], squares) = TriangleFan::new(&at(own[0].vertex), triangles).closest();
            for (lane, candidate) in some.iter().enumerate() {
                let d = squares[lane].sqrt();
                let weights = [1.0 - p[lane] - q[lane], p[lane], q[lane]];
                let Some(pair) = self.face_pair(candidate, weights, d) else {
                    continue;
                };
                out.near.push(*candidate);
                // In a flat sheet the closest points of neighbours lie on the face's border.
                if weights.iter().all(|w| *w > self.settings.min_weight) {
                    out.pairs.push(pair);
                } else if d < nearest.0
                    && !candidate.is_in_one_ring
                    && !surface(self.model, candidate.garment)
                        .is_border_point(candidate.face, weights)
                {
                    nearest = (d, Some(pair));
                }
            }
        }
        out.pairs.extend(nearest.1);
    }

    /// A vertex and a face within reach, by the weights of the closest point and its distance, metres.
    fn face_pair(&self, candidate: &FaceCandidate, weights: [f32; 3], d: f32) -> Option<NearPair> {
        if d >= self.reach.farthest || d <= self.settings.shortest {
            return None;
        }
        let (x, velocity) = (&self.all.x, &self.all.velocity);
        let (v, corners) = (candidate.vertex as usize, candidate.corners);
        let (mut offset, mut speed) = (-x[v].coords, -velocity[v]);
        for (c, w) in corners.into_iter().zip(weights) {
            offset += x[c as usize].coords * w;
            speed += velocity[c as usize] * w;
        }
        let normal = offset / d;
        let is_near = self.reach.is_near(&normal, d, &-speed);
        is_near.then_some(NearPair {
            vertices: [candidate.vertex, corners[0], corners[1], corners[2]],
            below: 1,
            normal,
        })
    }

    /// Pairs of an edge with edges of the faces near its ends.
    fn pairs_of_edge(
        &self,
        numbers: &EdgeNumbers,
        near: NearFaces<'_>,
        edge: u32,
        out: &mut EdgeFindings,
    ) {
        let [garment, own] = numbers.in_garment(edge);
        let ends = self.all.ends(self.model, garment, own);
        for f in ends.iter().flat_map(|v| near.of(*v)) {
            let g = &self.model.garments[f.garment as usize].topology;
            for e in g.face_edges[f.face as usize] {
                let other = numbers.of(f.garment, e);
                if std::mem::replace(&mut out.met[other as usize], edge) == edge {
                    continue;
                }
                let others = self.all.ends(self.model, f.garment, e);
                if others.iter().any(|v| ends.contains(v)) {
                    continue;
                }
                // The smaller edge has found it if an end of the other is near a face of this one.
                let is_found = || {
                    let mut near = others.iter().flat_map(|c| near.of(*c));
                    near.any(|f| ends.iter().all(|v| f.corners.contains(v)))
                };
                if let Some(pair) = self.edge_pair(ends, others)
                    && (edge < other || !is_found())
                {
                    out.pairs.push(pair);
                }
            }
        }
    }

    /// Two edges within reach whose closest points are no ends.
    fn edge_pair(&self, a: [u32; 2], b: [u32; 2]) -> Option<NearPair> {
        let at = |e: [u32; 2]| e.map(|v| self.all.x[v as usize]);
        let ([s, t], offset) = closest_inside(at(a), at(b), self.settings.min_sine_squared)?;
        let d = offset.norm();
        if d >= self.reach.farthest || d <= self.settings.shortest {
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
        let is_near = self.reach.is_near(&normal, d, &(of(a, s) - of(b, t)));
        is_near.then_some(pair)
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
            let Some(([s, t], offset)) = closest_inside(a, b, 1e-3) else {
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
        assert_eq!(
            closest_inside(x(0.0, 0.0), x(0.1, 0.0), 1e-3),
            None,
            "parallel"
        );
        assert_eq!(
            closest_inside([P3::origin(); 2], x(0.1, 0.0), 1e-3),
            None,
            "a point"
        );
    }
}
