//! Near pairs of features of an outfit: vertices and faces, edges and edges, of two garments or of folds of one.

use super::near_candidates::{FaceCandidate, NearCandidates};
use super::outfit_vertices::{OutfitVertices, surface};
use crate::live::outfit_model::Model;
use crate::settings::NearPairSettings;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par;
use tryon_geometry::spatial::closest_on_triangle;

/// Candidates that one thread looks at in a row.
const CHUNK: usize = 2048;
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
    found: [Vec<Vec<NearPair>>; 2],
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
        let edges = model.garments.iter().map(|g| g.self_contact.edge());
        let reach = settings.reach_edges * edges.fold(0.0, f32::max);
        let search = NearPairSearch {
            model,
            all,
            settings,
            reach,
            farthest: reach.max(settings.farthest),
            span,
        };
        let par = model.config.par;
        let [faces, edges] = &mut self.found;
        // A vertex' candidates stay together.
        let of_vertices: Vec<&[FaceCandidate]> = candidates
            .faces
            .chunk_by(|a, b| a.vertex / BLOCK == b.vertex / BLOCK)
            .collect();
        faces.resize_with(of_vertices.len(), Vec::new);
        par::for_chunks(par, faces, 1, |k, out| {
            let out = &mut out[0];
            out.clear();
            for own in of_vertices[k].chunk_by(|a, b| a.vertex == b.vertex) {
                search.pairs_with_faces(own, out);
            }
        });
        let of_edges: Vec<_> = candidates.edges.chunks(CHUNK).collect();
        edges.resize_with(of_edges.len(), Vec::new);
        par::for_chunks(par, edges, 1, |k, out| {
            let out = &mut out[0];
            out.clear();
            out.extend(
                of_edges[k]
                    .iter()
                    .filter_map(|[a, b]| search.edge_pair(*a, *b)),
            );
        });
        self.pairs.clear();
        for found in self.found.iter().flatten() {
            self.pairs.extend_from_slice(found);
        }
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
    /// Reach at rest and at most, metres.
    reach: f32,
    farthest: f32,
    /// Time until the next query, s.
    span: f32,
}

impl NearPairSearch<'_> {
    /// Reach of what closes at this speed, metres.
    fn reach_at(&self, closing: f32) -> f32 {
        (self.reach + closing.max(0.0) * self.span).min(self.farthest)
    }

    /// Pairs of one vertex with faces. Of points on edges and corners only the nearest counts.
    fn pairs_with_faces(&self, own: &[FaceCandidate], out: &mut Vec<NearPair>) {
        let mut nearest = (f32::INFINITY, None);
        for candidate in own {
            let Some((pair, d, weights)) = self.face_pair(candidate) else {
                continue;
            };
            if weights.iter().all(|w| *w > self.settings.min_weight) {
                out.push(pair);
            } else if d < nearest.0
                && !surface(self.model, candidate.garment).is_border_point(candidate.face, weights)
            {
                nearest = (d, Some(pair));
            }
        }
        out.extend(nearest.1);
    }

    /// A vertex and a face within reach, their distance, metres, and the weights of the closest point.
    fn face_pair(&self, candidate: &FaceCandidate) -> Option<(NearPair, f32, [f32; 3])> {
        let (x, velocity) = (&self.all.x, &self.all.velocity);
        let (v, corners) = (candidate.vertex as usize, candidate.corners);
        let at = corners.map(|c| x[c as usize]);
        let weights = closest_on_triangle(&x[v], at);
        let mut offset = -x[v].coords;
        for k in 0..3 {
            offset += at[k].coords * weights[k];
        }
        let d = offset.norm();
        if d >= self.farthest || d <= self.settings.shortest {
            return None;
        }
        let mut speed = -velocity[v];
        for k in 0..3 {
            speed += velocity[corners[k] as usize] * weights[k];
        }
        let normal = offset / d;
        if d >= self.reach_at(-normal.dot(&speed)) {
            return None;
        }
        let pair = NearPair {
            vertices: [candidate.vertex, corners[0], corners[1], corners[2]],
            below: 1,
            normal,
        };
        // In a flat sheet the closest points of neighbours lie on the face's border.
        let is_inside = weights.iter().all(|w| *w > self.settings.min_weight);
        (is_inside || !candidate.is_in_one_ring).then_some((pair, d, weights))
    }

    /// Two edges within reach whose closest points are no ends.
    fn edge_pair(&self, a: [u32; 2], b: [u32; 2]) -> Option<NearPair> {
        let at = |e: [u32; 2]| e.map(|v| self.all.x[v as usize]);
        let ([s, t], offset) = closest_inside(at(a), at(b), self.settings.min_sine_squared)?;
        let d = offset.norm();
        if d >= self.farthest || d <= self.settings.shortest {
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
