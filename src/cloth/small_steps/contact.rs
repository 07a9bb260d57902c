//! What keeps a vertex outside a body, and what ties it to one, within small steps.

use super::fabric::{Fabric, MOST};
use super::forces::Step;
use super::motion::{Motion, V4};

/// A surface near a vertex: a plane that moves evenly until it is looked for again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Plane {
    /// Cloth vertex.
    pub vertex: u32,
    /// Unit normal, outward.
    pub normal: V4,
    /// The vertex must have `normal · x ≥ level`, metres, at time 0 of the call.
    pub level: f32,
    /// Speed of the surface, m/s.
    pub speed: V4,
    /// Coulomb coefficient.
    pub friction: f32,
}

/// A vertex whose place is given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tie {
    /// Cloth vertex.
    pub vertex: u32,
    /// Where it belongs at time 0, metres.
    pub place: V4,
    /// Speed of that place, m/s.
    pub speed: V4,
    /// Share of the way there that each step goes: 1 is rigid.
    pub firmness: f32,
}

/// Speed that a vertex may gain towards a surface while planes out of reach are left out, m/s: over 1.7 ms it takes 120
/// times its weight.
const GAINED: f32 = 2.0;
/// Share of a penetration that one step takes away.
const RECOVERED: f32 = 0.2;

impl Motion {
    /// Adds to the accelerations what planes and ties will answer, by the rules of [`Motion::restrain`]: smoothed without
    /// it, a force or a speed that ends in a contact would push its neighbours, and a contact that stops one vertex alone
    /// would give fine waves, which have much inertia, energy out of nothing.
    pub(super) fn answer(&mut self, f: &Fabric, planes: &[Plane], ties: &[Tie], step: &Step) {
        let h = step.h;
        let n = f.reach(step.rings.saturating_add(f.smoothing.len() - 1));
        let held = &mut self.work.held;
        let push: &mut [V4; MOST] = &mut self.work.push;
        for p in planes {
            let i = p.vertex as usize;
            if i >= n {
                continue;
            }
            let v = self.velocity[i] + push[i].scale(h);
            let rate = p.normal.dot(p.speed);
            let toward = p.normal.dot(v) - rate;
            let gap = p.normal.dot(self.start[i] + self.moved[i]) - p.level - rate * step.t;
            let least = -gap.max(0.0) / h;
            if toward < least {
                let borne = least - toward;
                let slip = v - p.speed - p.normal.scale(toward);
                let speed = slip.dot(slip).sqrt();
                let stopped = if speed > 0.0 { (p.friction * borne / speed).min(1.0) } else { 0.0 };
                push[i] = push[i] + (p.normal.scale(borne) - slip.scale(stopped)).scale(1.0 / h);
            }
        }
        held.clear();
        for t in ties {
            let i = t.vertex as usize;
            push[i] = push[i].scale(1.0 - t.firmness);
            if t.firmness >= 1.0 {
                held.push(t.vertex);
            }
        }
    }
    /// Adds to `out` those of the planes that their vertices may come to within `span` seconds from time `t`.
    pub fn within_reach(&self, planes: &[Plane], t: f32, span: f32, out: &mut Vec<Plane>) {
        let near = |p: &&Plane| {
            let i = p.vertex as usize;
            let rate = p.normal.dot(p.speed);
            let toward = p.normal.dot(self.velocity[i]) - rate;
            let gap = p.normal.dot(self.position(i)) - p.level - rate * t;
            gap < span * (GAINED - toward.min(0.0))
        };
        out.extend(planes.iter().filter(near));
    }
    /// Takes from velocities what would lead through the planes by the end of a step of `h` that begins at time `t`;
    /// Coulomb friction against the surface. What is sunken comes out at `recovery` m/s at most.
    /// Returns how many vertices were touched.
    pub fn restrain(&mut self, planes: &[Plane], t: f32, h: f32, recovery: f32) -> usize {
        let mut touched = 0;
        for p in planes {
            let i = p.vertex as usize;
            let rate = p.normal.dot(p.speed);
            let gap = p.normal.dot(self.position(i)) - p.level - rate * t;
            let v = self.velocity[i];
            let toward = p.normal.dot(v) - rate;
            // Above the surface a step may just reach it; below, it may not go deeper.
            let least = -gap.max(0.0) / h;
            if toward < least {
                let push = least - toward;
                let slip = v - p.speed - p.normal.scale(toward);
                let speed = slip.dot(slip).sqrt();
                let kept = if speed > 0.0 { (1.0 - p.friction * push / speed).max(0.0) } else { 0.0 };
                // `toward` is relative to the surface: its own speed comes back with the normal part.
                self.velocity[i] = p.speed + p.normal.scale(least) + slip.scale(kept);
                touched += 1;
            }
            if gap < 0.0 {
                self.moved[i] = self.moved[i] + p.normal.scale((-gap * RECOVERED).min(recovery * h));
            }
        }
        touched
    }
    /// Brings tied vertices to their places at the end of a step of `h` that begins at time `t`.
    pub fn tie(&mut self, ties: &[Tie], t: f32, h: f32) {
        for a in ties {
            let i = a.vertex as usize;
            let wanted = (a.place + a.speed.scale(t + h) - self.position(i)).scale(1.0 / h);
            let v = self.velocity[i];
            self.velocity[i] = v + (wanted - v).scale(a.firmness);
        }
    }
}
