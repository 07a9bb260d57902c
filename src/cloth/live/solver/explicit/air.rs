//! Drag of still air on triangles: k A |v| v along the normal, v the normal component of their velocity, k = ½ ρ C.

use super::active_set::{ActiveSet, active_ranges, clip};
use super::blocks::lowest;
use super::patch_model::PatchModel;
use super::simd::{LANES, Slot};
use super::vec4::{MAX_VERTICES, V4};

/// Normal speed beyond which drag grows no more (m/s): forces are kept for a millisecond, and faster cloth would be pushed
/// back beyond rest.
const FASTEST: f32 = 20.0;
/// Square of twice the area below which a triangle has no normal (m⁴).
const SMALLEST: f32 = 1e-20;

/// Vertices of a patch in the air.
pub(super) struct Airflow<'a> {
    pub(super) x: &'a [V4; MAX_VERTICES],
    /// Velocities (m/s).
    pub(super) v: &'a [V4],
}

impl Airflow<'_> {
    /// Adds the forces (N) on all triangles with a vertex below `end` that do not sleep.
    pub(super) fn add(
        &self,
        f: &PatchModel,
        active: &Option<ActiveSet>,
        end: usize,
        out: &mut [V4; MAX_VERTICES],
    ) {
        if f.air <= 0.0 {
            return;
        }
        let asleep = active.as_ref().map_or(&[][..], |a| &a.asleep);
        let blocks = f.quads.partition_point(|q| lowest(&q.v) < end);
        let all = 0..blocks;
        for r in active_ranges(active, &all, |a| &a.quads) {
            for q in &f.quads[clip(r, blocks)] {
                for lane in 0..LANES {
                    let [a, b, c, d] = [0, 1, 2, 3].map(|i| q.v[i][lane]);
                    self.add_triangle(f.air, asleep, [a, b, c], out);
                    if d.index() != c.index() {
                        self.add_triangle(f.air, asleep, [b, a, d], out);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn add_triangle(
        &self,
        air: f32,
        asleep: &[bool],
        corners: [Slot; 3],
        out: &mut [V4; MAX_VERTICES],
    ) {
        let sleeps = |c: &Slot| asleep.get(c.index()).copied().unwrap_or(false);
        if corners.iter().any(sleeps) {
            return;
        }
        let [a, b, c] = corners.map(|s| s.get(self.x));
        let normal = cross(b - a, c - a);
        let square = normal.dot(normal);
        if square < SMALLEST {
            return;
        }
        let [u, v, w] = corners.map(|s| self.v[s.index()]);
        let through = (u + v + w).dot(normal) / (3.0 * square.sqrt());
        let size = through.abs().min(FASTEST);
        // A third of k A |v| v, with the normal twice as long as the area.
        let force = normal.scale(air * size * through.clamp(-FASTEST, FASTEST) / 6.0);
        for s in corners {
            s.set(out, s.get(out) - force);
        }
    }
}

fn cross(a: V4, b: V4) -> V4 {
    let ([x, y, z, _], [u, v, w, _]) = (a.0, b.0);
    V4::new(y * w - z * v, z * u - x * w, x * v - y * u)
}
