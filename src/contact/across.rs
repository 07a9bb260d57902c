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
    /// How far both may move before it must be looked at again, metres.
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
        // Skin that is not looked for is not found either.
        let looked_for = self.before.iter().zip(&frame.vertices).zip(others).filter(|(_, mask)| **mask != 0);
        let moved = 2.0 * looked_for.map(|((a, b), _)| (a - b).norm_squared()).fold(0.0, f32::max).sqrt();
        self.before.clone_from(&frame.vertices);
        let starts = if first { model.starts(par, frame, &frame.vertices, others.iter()) } else { Vec::new() };
        par::for_chunks(par, &mut self.seen, 256, |start, chunk| {
            for (k, s) in chunk.iter_mut().enumerate() {
                let (v, mask) = (start + k, others[start + k]);
                if mask == 0 {
                    continue;
                }
                if s.room > moved {
                    s.room -= moved;
                    continue;
                }
                let p = &frame.vertices[v];
                if let Some(start) = starts.get(v) {
                    s.nearest = *start;
                }
                let (near, hit) = model.closest_within(frame, p, s.nearest, mask, reach);
                *s = Seen { nearest: near, room: hit.err().unwrap_or(0.0), found: judge(v, near, &hit) };
            }
        });
    }
}
