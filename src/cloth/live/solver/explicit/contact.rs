//! Contact and pins at the velocity level.

use super::constraint::{ContactPlane, Pin};
use super::patch_model::PatchModel;
use super::patch_state::{PatchState, Substep};
use super::vec4::{MAX_VERTICES, V4};

/// Recovery from a penetration.
#[derive(Clone, Copy, Debug)]
pub struct Recovery {
    /// Share of the penetration that one substep removes.
    pub share: f32,
    /// Its largest speed (m/s).
    pub speed: f32,
}

/// Contact planes vertex by vertex, those of cloth before those of the body.
#[derive(Clone, Debug, Default)]
pub struct VertexPlanes {
    planes: Vec<ContactPlane>,
    runs: Vec<PlaneRun>,
}

/// Planes of one vertex: indices of the first, of the first of the body, and the end.
#[derive(Clone, Copy, Debug)]
struct PlaneRun {
    first: u32,
    body: u32,
    end: u32,
}

impl VertexPlanes {
    /// Planes of cloth and of the body; each list is sorted by vertex.
    pub fn new(cloth: &[ContactPlane], body: &[ContactPlane]) -> Self {
        let mut planes = Self::default();
        planes.merge(cloth.iter(), body.iter(), |_| true);
        planes
    }
    /// Replaces them by those planes of cloth and of the body, each list sorted by vertex, that vertices may reach within
    /// `span` seconds from time `t`, if they gain `gain` m/s at most.
    pub fn select<'a>(
        &mut self,
        motion: &PatchState,
        cloth: &'a [ContactPlane],
        body: impl Iterator<Item = &'a ContactPlane>,
        [t, span, gain]: [f32; 3],
    ) {
        self.merge(cloth.iter(), body, |p| {
            motion.is_reachable(p, [t, span], gain)
        });
    }
    fn merge<'a>(
        &mut self,
        cloth: impl Iterator<Item = &'a ContactPlane>,
        body: impl Iterator<Item = &'a ContactPlane>,
        is_wanted: impl Fn(&ContactPlane) -> bool,
    ) {
        self.planes.clear();
        self.runs.clear();
        let mut cloth = cloth.filter(|p| is_wanted(p)).peekable();
        let mut body = body.filter(|p| is_wanted(p)).peekable();
        loop {
            let vertex = match (cloth.peek(), body.peek()) {
                (Some(a), Some(b)) => a.vertex.min(b.vertex),
                (Some(p), None) | (None, Some(p)) => p.vertex,
                (None, None) => break,
            };
            let own = |p: &&ContactPlane| p.vertex == vertex;
            let first = self.planes.len() as u32;
            self.planes
                .extend(std::iter::from_fn(|| cloth.next_if(own)));
            let middle = self.planes.len() as u32;
            self.planes.extend(std::iter::from_fn(|| body.next_if(own)));
            self.runs.push(PlaneRun {
                first,
                body: middle,
                end: self.planes.len() as u32,
            });
        }
    }
    /// Planes of cloth and of the body of one vertex.
    fn of(&self, run: &PlaneRun) -> (&[ContactPlane], &[ContactPlane]) {
        let own = &self.planes[run.first as usize..run.end as usize];
        own.split_at((run.body - run.first) as usize)
    }
}

/// Velocity of one vertex against a plane, split into normal and tangential parts.
struct Approach {
    /// Normal velocity relative to the surface (m/s).
    normal: f32,
    /// Least normal velocity that violates nothing by the end of the substep (m/s).
    least: f32,
    /// Distance from the plane (m).
    gap: f32,
}

impl Approach {
    #[inline(always)]
    fn new(p: &ContactPlane, x: V4, v: V4, t: f32, h: f32) -> Self {
        let gap = p.gap(x, t);
        Self {
            normal: p.normal.dot(v) - p.rate(),
            // Above the surface a substep may just reach it; below, it may not go deeper.
            least: -gap.max(0.0) / h,
            gap,
        }
    }
    /// Tangential velocity relative to the surface (m/s).
    #[inline(always)]
    fn slip(&self, p: &ContactPlane, v: V4) -> V4 {
        v - p.velocity - p.normal.scale(self.normal)
    }
}

impl PatchState {
    /// Adds the answer of planes and pins to the accelerations, by the rules of [`PatchState::resolve_contacts`]. Filtered
    /// without it, a force that ends in a contact would push its neighbours and add energy to fine waves.
    pub(super) fn predict_contacts(
        &mut self,
        f: &PatchModel,
        planes: &VertexPlanes,
        pins: &[Pin],
        step: &Substep,
    ) {
        let h = step.h;
        let n = f.reach(step.rings.saturating_add(f.filter.len() - 1));
        let acceleration: &mut [V4; MAX_VERTICES] = &mut self.scratch.acceleration;
        for p in &planes.planes {
            let i = p.vertex as usize;
            if i >= n {
                continue;
            }
            let v = self.velocity[i] + acceleration[i].scale(h);
            let a = Approach::new(p, self.start[i] + self.displacement[i], v, step.t, h);
            if a.normal < a.least {
                let impulse = a.least - a.normal;
                let slip = a.slip(p, v);
                let speed = slip.dot(slip).sqrt();
                let stopped = if speed > 0.0 {
                    (p.friction * impulse / speed).min(1.0)
                } else {
                    0.0
                };
                let change = p.normal.scale(impulse) - slip.scale(stopped);
                acceleration[i] = acceleration[i] + change.scale(1.0 / h);
            }
        }
        self.scratch.pinned.clear();
        for pin in pins {
            let i = pin.vertex as usize;
            acceleration[i] = acceleration[i].scale(1.0 - pin.stiffness);
            if pin.stiffness >= 1.0 {
                self.scratch.pinned.push(pin.vertex);
            }
        }
    }
    /// The plane may be reached by its vertex within `span` seconds from time `t`, if that gains `gain` m/s at most.
    fn is_reachable(&self, p: &ContactPlane, [t, span]: [f32; 2], gain: f32) -> bool {
        let i = p.vertex as usize;
        let toward = p.normal.dot(self.velocity[i]) - p.rate();
        p.gap(self.position(i), t) < span * (gain - toward.min(0.0))
    }
    /// Removes velocities into the planes by the end of a substep of `h` that begins at time `t`, with Coulomb friction
    /// against the surface. Planes of one substep that oppose each other move a vertex out along none of them. Cloth holds
    /// once more after the body: what it passes stays passed, what is below the skin comes out later. Returns the number of
    /// contacts with the body.
    pub fn resolve_contacts(
        &mut self,
        planes: &VertexPlanes,
        substep: [f32; 2],
        recovery: [Recovery; 2],
    ) -> usize {
        let mut touched = 0;
        for run in &planes.runs {
            let (cloth, body) = planes.of(run);
            for p in cloth {
                self.resolve(p, substep, recovery[0]);
            }
            let before = touched;
            for p in body {
                touched += usize::from(self.resolve(p, substep, recovery[1]));
            }
            if touched > before || cloth.len() > 1 {
                cloth.iter().for_each(|p| self.hold(p, substep));
            }
        }
        touched
    }
    /// True if the vertex meets the plane.
    #[inline(always)]
    fn resolve(&mut self, p: &ContactPlane, [t, h]: [f32; 2], recovery: Recovery) -> bool {
        let i = p.vertex as usize;
        let v = self.velocity[i];
        let a = Approach::new(p, self.position(i), v, t, h);
        let touches = a.normal < a.least;
        if touches {
            let impulse = a.least - a.normal;
            let slip = a.slip(p, v);
            let speed = slip.dot(slip).sqrt();
            let kept = if speed > 0.0 {
                (1.0 - p.friction * impulse / speed).max(0.0)
            } else {
                0.0
            };
            self.velocity[i] = p.velocity + p.normal.scale(a.least) + slip.scale(kept);
        }
        if a.gap < 0.0 {
            self.recover(p, (-a.gap * recovery.share).min(recovery.speed * h));
        }
        touches
    }
    /// Removes the velocity into a plane without friction, and the part of this substep's recovery that passes it: the last
    /// word on a vertex whose planes contradict each other.
    fn hold(&mut self, p: &ContactPlane, [t, h]: [f32; 2]) {
        let i = p.vertex as usize;
        let passed = self.scratch.recovered[i].dot(p.normal).min(0.0);
        let gap = p.gap(self.position(i), t).min(0.0);
        let back = p.normal.scale(-gap.max(passed));
        self.displacement[i] = self.displacement[i] + back;
        self.scratch.recovered[i] = self.scratch.recovered[i] + back;
        let a = Approach::new(p, self.position(i), self.velocity[i], t, h);
        let lacking = (a.least - a.normal).max(0.0);
        self.velocity[i] = self.velocity[i] + p.normal.scale(lacking);
    }
    /// Moves a vertex out along a plane's normal, without undoing the recovery from opposite planes.
    fn recover(&mut self, p: &ContactPlane, distance: f32) {
        let i = p.vertex as usize;
        let before = self.scratch.recovered[i];
        let against = before.dot(p.normal);
        let mut push = p.normal.scale(distance);
        if against < 0.0 {
            push = push + p.normal.scale(against) - before;
        }
        self.displacement[i] = self.displacement[i] + push;
        self.scratch.recovered[i] = before + push;
        self.scratch.penetrating.push(p.vertex);
    }
    /// Velocities that bring pinned vertices to their targets by the end of a substep of `h` that begins at time `t`.
    pub fn apply_pins(&mut self, pins: &[Pin], t: f32, h: f32) {
        for pin in pins {
            let i = pin.vertex as usize;
            let target = pin.target + pin.velocity.scale(t + h);
            let wanted = (target - self.position(i)).scale(1.0 / h);
            let v = self.velocity[i];
            self.velocity[i] = v + (wanted - v).scale(pin.stiffness);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_sheets::RECOVERY;
    use super::*;

    /// Displacement in one substep of a vertex at the origin, 1 cm under planes with these normals (m).
    fn recovery(normals: &[[f32; 2]]) -> V4 {
        let mut state = PatchState::default();
        state.reset([V4::default()].into_iter(), [V4::default()].into_iter());
        for n in normals {
            let plane = ContactPlane {
                normal: V4::new(n[0], n[1], 0.0),
                offset: 0.01,
                ..ContactPlane::default()
            };
            state.resolve(&plane, [0.0, 1e-3], RECOVERY);
        }
        state.displacement[0]
    }

    #[test]
    fn held_planes_take_back_recovery_and_velocity_that_pass_them() {
        let mut state = PatchState::default();
        state.reset(
            [V4::default()].into_iter(),
            [V4::new(0.0, 1.0, 0.0)].into_iter(),
        );
        let plane = |x: f32, offset: f32| ContactPlane {
            normal: V4::new(x, 0.0, 0.0),
            offset,
            velocity: V4::new(0.3, 0.0, 0.0),
            ..ContactPlane::default()
        };
        let (skin, cloth) = (plane(1.0, 0.01), plane(-1.0, -2e-4));
        state.resolve(&skin, [0.0, 1e-3], RECOVERY);
        assert_eq!(state.displacement[0], V4::new(1e-3, 0.0, 0.0));
        state.hold(&cloth, [0.0, 1e-3]);
        let V4([x, ..]) = state.displacement[0];
        assert!((x - 2e-4).abs() < 1e-9, "{x} m, the plane is at 0.2 mm");
        let V4([u, v, ..]) = state.velocity[0];
        assert!(
            (u - 0.3).abs() < 1e-6 && v == 1.0,
            "{u} {v} m/s: with the plane, sliding"
        );
    }

    #[test]
    fn opposite_planes_do_not_squeeze_a_vertex_out_between_them() {
        let distance = 1e-3; // a substep at 1 m/s
        for angle in [0.0f32, 0.1, 0.5, 1.0, 1.5] {
            let leaning = [-angle.cos(), angle.sin()];
            let V4([x, y, z, _]) = recovery(&[leaning, [1.0, 0.0]]);
            let out = distance * (1.0 - angle.cos());
            assert!(
                (x - out).abs() < 1e-9 && y.abs() < 1e-9 && z == 0.0,
                "{angle}: {x} {y}"
            );
        }
        let right = recovery(&[[0.0, 1.0], [1.0, 0.0]]);
        assert_eq!(
            right,
            V4::new(distance, distance, 0.0),
            "in a corner both push"
        );
    }
}
