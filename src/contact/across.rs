//! What each vertex of the skin has of another part of the body near it, looked at again only where that may have changed.

use super::{Closest, Part, SurfaceFrame, SurfaceModel};
use crate::math::P3;
use crate::par::{self, Par};
use serde::{Deserialize, Serialize};

/// Of all vertices; `T` is what is kept of a look.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Across<T> {
    pub(super) seen: Vec<Seen<T>>,
    before: Vec<P3>,
}

/// Of one vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Seen<T> {
    /// Nearest vertex of the other part.
    nearest: u32,
    /// How far it and the other part may move together before it must be looked at again, metres.
    room: f32,
    pub(super) found: T,
}

impl<T: Copy + Default + Send + Sync> Across<T> {
    /// Looks within `reach` metres of each vertex for the part in `others`, 0 for none, where the last look left no room.
    /// `judge` gets the vertex, the nearest one of the part, and the nearest point, or how far beyond reach it is at least.
    pub(super) fn look(
        &mut self,
        par: Par,
        model: &SurfaceModel,
        others: &[Part],
        frame: &SurfaceFrame,
        reach: f32,
        judge: impl Fn(usize, u32, &Result<Closest, f32>) -> T + Sync,
    ) {
        let n = frame.vertices.len();
        let first = self.seen.len() != n;
        if first {
            self.seen = vec![Seen::default(); n];
            self.before.clone_from(&frame.vertices);
        }
        let way = |v: usize| (self.before[v] - frame.vertices[v]).norm();
        let ways = farthest(model, others, way);
        let starts = if first {
            model.starts(par, frame, &frame.vertices, others.iter())
        } else {
            Vec::new()
        };
        par::for_chunks(par, &mut self.seen, 256, |start, chunk| {
            for (k, s) in chunk.iter_mut().enumerate() {
                let (v, mask) = (start + k, others[start + k]);
                if mask == 0 {
                    continue;
                }
                let moved = way(v) + ways[usize::from(mask)];
                if s.room > moved {
                    s.room -= moved;
                    continue;
                }
                let p = &frame.vertices[v];
                if let Some(start) = starts.get(v) {
                    s.nearest = *start;
                }
                let (near, hit) = model.closest_within(frame, p, s.nearest, mask, reach);
                *s = Seen {
                    nearest: near,
                    room: hit.err().unwrap_or(0.0),
                    found: judge(v, near, &hit),
                };
            }
        });
        self.before.clone_from(&frame.vertices);
    }
}

/// The longest way of a vertex in the parts of each mask. Skin that is not looked for is not found either.
fn farthest(
    model: &SurfaceModel,
    others: &[Part],
    way: impl Fn(usize) -> f32,
) -> [f32; 1 << Part::BITS] {
    let mut of_part = [0.0f32; 1 << Part::BITS];
    for v in (0..others.len()).filter(|v| others[*v] != 0) {
        let most = &mut of_part[usize::from(model.part(v as u32))];
        *most = most.max(way(v));
    }
    let moved: Vec<usize> = (0..of_part.len())
        .filter(|part| of_part[*part] > 0.0)
        .collect();
    std::array::from_fn(|mask| {
        moved
            .iter()
            .filter(|part| *part & mask != 0)
            .fold(0.0, |most: f32, part| most.max(of_part[*part]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::surface::tests::two_spheres;

    #[test]
    fn each_mask_knows_the_longest_way_of_its_parts_that_are_looked_for() {
        let (model, frame, n) = two_spheres(2, 1.0, [0.0, 3.0], [1, 2]);
        let way = |v: usize| {
            if v == 5 {
                0.1
            } else if v == n + 7 {
                0.3
            } else {
                0.0
            }
        };
        let ways =
            |others: &[Part]| [1usize, 2, 3, 4, 6].map(|mask| farthest(&model, others, way)[mask]);
        let mut others = vec![2; n];
        others.resize(frame.vertices.len(), 1);
        assert_eq!(ways(&others), [0.1, 0.3, 0.3, 0.0, 0.3]);
        others[n + 7] = 0;
        assert_eq!(ways(&others), [0.1, 0.0, 0.1, 0.0, 0.0]);
    }

    #[test]
    fn what_moves_less_than_the_room_to_a_part_that_stays_is_not_looked_at_again() {
        let (model, frame, n) = two_spheres(2, 1.0, [0.0, 3.0], [1, 2]);
        let looks = std::sync::atomic::AtomicUsize::new(0);
        let mut across = Across::<()>::default();
        let mut look = |others: &[Part], shift: f32| {
            let mut moved = SurfaceFrame {
                vertices: frame.vertices.clone(),
                normals: Vec::new(),
            };
            moved.vertices[n..].iter_mut().for_each(|p| p.x += shift);
            across.look(Par::Seq, &model, others, &moved, 0.0, |_, _, _| {
                looks.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            });
            looks.swap(0, std::sync::atomic::Ordering::Relaxed)
        };
        // The left sphere looks for the right one, which is a metre off at least, and the other way round.
        let mut both = vec![2; n];
        both.resize(2 * n, 1);
        assert_eq!(look(&both, 0.0), 2 * n);
        assert_eq!(look(&both, 0.6), 0);
        let again = look(&both, 0.1);
        assert!(again > 0 && again < 2 * n, "{again}");
    }
}
