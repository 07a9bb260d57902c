//! Temporal coherence of proximity queries between parts of one surface.
//!
//! A vertex is queried again only when it and the other part may have moved through the clearance of its last query.

use super::{ClosestPoint, Part, SearchExtent, SurfaceFrame, SurfaceModel};
use serde::{Deserialize, Serialize};
use tryon_geometry::math::P3;
use tryon_geometry::par::{self, Par};

/// Last query of every vertex; `T` is what its caller keeps of the result.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct ProximityCache<T> {
    pub(super) entries: Vec<Proximity<T>>,
    previous: Vec<P3>,
}

/// Last query of one vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Proximity<T> {
    /// Nearest vertex of the other part.
    nearest: u32,
    /// Displacement of both until the next query, metres.
    clearance: f32,
    pub(super) result: T,
}

/// The surface and the part that each vertex is queried against, 0 for none.
#[derive(Clone, Copy)]
pub(super) struct PartQuery<'a> {
    pub(super) surface: &'a SurfaceModel,
    pub(super) frame: &'a SurfaceFrame,
    pub(super) others: &'a [Part],
    /// Distance of interest, metres.
    pub(super) reach: f32,
}

impl<T: Copy + Default + Send + Sync> ProximityCache<T> {
    /// Queries the vertices whose last clearance is used up.
    ///
    /// `classify` receives the vertex, the nearest one of the other part, and the closest point within reach, or its
    /// least distance beyond reach.
    pub(super) fn update(
        &mut self,
        par: Par,
        query: &PartQuery<'_>,
        classify: impl Fn(usize, u32, &Result<ClosestPoint, f32>) -> T + Sync,
    ) {
        let PartQuery {
            surface,
            frame,
            others,
            reach,
        } = *query;
        let n = frame.vertices.len();
        let first = self.entries.len() != n;
        if first {
            self.entries = vec![Proximity::default(); n];
            self.previous.clone_from(&frame.vertices);
        }
        let displacement = |v: usize| (self.previous[v] - frame.vertices[v]).norm();
        let largest = largest_displacements(surface, others, displacement);
        let starts = if first {
            surface.walk_starts(par, frame, &frame.vertices, others.iter())
        } else {
            Vec::new()
        };
        par::for_chunks(par, &mut self.entries, 256, |start, chunk| {
            for (k, e) in chunk.iter_mut().enumerate() {
                let (v, mask) = (start + k, others[start + k]);
                if mask == 0 {
                    continue;
                }
                let moved = displacement(v) + largest[usize::from(mask)];
                if e.clearance > moved {
                    e.clearance -= moved;
                    continue;
                }
                let p = &frame.vertices[v];
                if let Some(start) = starts.get(v) {
                    e.nearest = *start;
                }
                let extent = SearchExtent { mask, reach };
                let (nearest, hit) = surface.closest_within(frame, p, e.nearest, extent);
                *e = Proximity {
                    nearest,
                    clearance: hit.err().unwrap_or(0.0),
                    result: classify(v, nearest, &hit),
                };
            }
        });
        self.previous.clone_from(&frame.vertices);
    }
}

/// Largest displacement of the queried vertices among the parts of each mask, metres.
fn largest_displacements(
    surface: &SurfaceModel,
    others: &[Part],
    displacement: impl Fn(usize) -> f32,
) -> [f32; 1 << Part::BITS] {
    let mut of_part = [0.0f32; 1 << Part::BITS];
    for v in (0..others.len()).filter(|v| others[*v] != 0) {
        let largest = &mut of_part[usize::from(surface.part(v as u32))];
        *largest = largest.max(displacement(v));
    }
    let moved: Vec<usize> = (0..of_part.len())
        .filter(|part| of_part[*part] > 0.0)
        .collect();
    std::array::from_fn(|mask| {
        let within = moved.iter().filter(|part| *part & mask != 0);
        within.fold(0.0, |largest: f32, part| largest.max(of_part[*part]))
    })
}

#[cfg(test)]
mod tests {
    use super::super::test_shapes::two_spheres;
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn largest_displacement_of_a_mask_counts_queried_vertices_of_its_parts() {
        let (model, frame, n) = two_spheres(2, 1.0, [0.0, 3.0], [1, 2]);
        let displacement = |v: usize| match v {
            5 => 0.1,
            v if v == n + 7 => 0.3,
            _ => 0.0,
        };
        let of = |others: &[Part]| {
            let all = largest_displacements(&model, others, displacement);
            [1usize, 2, 3, 4, 6].map(|mask| all[mask])
        };
        let mut others = vec![2; n];
        others.resize(frame.vertices.len(), 1);
        assert_eq!(of(&others), [0.1, 0.3, 0.3, 0.0, 0.3]);
        others[n + 7] = 0;
        assert_eq!(of(&others), [0.1, 0.0, 0.1, 0.0, 0.0]);
    }

    #[test]
    fn vertices_are_queried_again_only_after_moving_through_their_clearance() {
        let (surface, frame, n) = two_spheres(2, 1.0, [0.0, 3.0], [1, 2]);
        let queries = AtomicUsize::new(0);
        let mut cache = ProximityCache::<()>::default();
        let mut count = |others: &[Part], shift: f32| {
            let mut moved = SurfaceFrame::without_normals(frame.vertices.clone());
            moved.vertices[n..].iter_mut().for_each(|p| p.x += shift);
            let query = PartQuery {
                surface: &surface,
                frame: &moved,
                others,
                reach: 0.0,
            };
            cache.update(Par::Seq, &query, |_, _, _| {
                queries.fetch_add(1, Ordering::Relaxed);
            });
            queries.swap(0, Ordering::Relaxed)
        };
        // Each sphere queries the other one, at least a metre away.
        let mut both = vec![2; n];
        both.resize(2 * n, 1);
        assert_eq!(count(&both, 0.0), 2 * n);
        assert_eq!(count(&both, 0.6), 0);
        let again = count(&both, 0.1);
        assert!(again > 0 && again < 2 * n, "{again}");
    }
}
