//! What keeps a vertex outside a body, and what ties it to one, within small steps.

use super::kernels::Substep;
use super::patch_model::{MOST, PatchModel};
use super::patch_state::{PatchState, V4};

/// A surface near a vertex: a plane that moves evenly until it is looked for again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactPlane {
    /// Cloth vertex.
    pub vertex: u32,
    /// Unit normal, outward.
    pub normal: V4,
    /// The vertex must have `normal · x ≥ level`, metres, at time 0 of the call.
    pub offset: f32,
    /// Speed of the surface, m/s.
    pub velocity: V4,
    /// Coulomb coefficient.
    pub friction: f32,
}

/// A vertex whose place is given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pin {
    /// Cloth vertex.
    pub vertex: u32,
    /// Where it belongs at time 0, metres.
    pub target: V4,
    /// Speed of that place, m/s.
    pub velocity: V4,
    /// Share of the way there that each step goes: 1 is rigid.
    pub stiffness: f32,
}

/// Speed that a vertex may gain towards a surface while planes out of reach are left out, m/s: over 1.7 ms it takes 120
/// times its weight.
const GAINED: f32 = 2.0;
/// Share of a penetration that one step takes away.
const RECOVERED: f32 = 0.2;

impl PatchState {
    /// Adds to the accelerations what planes and ties will answer, by the rules of [`PatchState::resolve_contacts`]: smoothed without
    /// it, a force or a speed that ends in a contact would push its neighbours, and a contact that stops one vertex alone
    /// would give fine waves, which have much inertia, energy out of nothing.
    pub(super) fn predict_contacts(
        &mut self,
        f: &PatchModel,
        planes: &[ContactPlane],
        ties: &[Pin],
        step: &Substep,
    ) {
        let h = step.h;
        let n = f.reach(step.rings.saturating_add(f.smoothing.len() - 1));
        let held = &mut self.scratch.held;
        let push: &mut [V4; MOST] = &mut self.scratch.push;
        for p in planes {
            let i = p.vertex as usize;
            if i >= n {
                continue;
            }
            let v = self.velocity[i] + push[i].scale(h);
            let rate = p.normal.dot(p.velocity);
            let toward = p.normal.dot(v) - rate;
            let gap = p.normal.dot(self.start[i] + self.displacement[i]) - p.offset - rate * step.t;
            let least = -gap.max(0.0) / h;
            if toward < least {
                let borne = least - toward;
                let slip = v - p.velocity - p.normal.scale(toward);
                let speed = slip.dot(slip).sqrt();
                let stopped = if speed > 0.0 {
                    (p.friction * borne / speed).min(1.0)
                } else {
                    0.0
                };
                push[i] = push[i] + (p.normal.scale(borne) - slip.scale(stopped)).scale(1.0 / h);
            }
        }
        held.clear();
        for t in ties {
            let i = t.vertex as usize;
            push[i] = push[i].scale(1.0 - t.stiffness);
            if t.stiffness >= 1.0 {
                held.push(t.vertex);
            }
        }
    }
    /// Adds to `out` those of the planes that their vertices may come to within `span` seconds from time `t`.
    pub fn find_reachable(
        &self,
        planes: &[ContactPlane],
        t: f32,
        span: f32,
        out: &mut Vec<ContactPlane>,
    ) {
        let near = |p: &&ContactPlane| {
            let i = p.vertex as usize;
            let rate = p.normal.dot(p.velocity);
            let toward = p.normal.dot(self.velocity[i]) - rate;
            let gap = p.normal.dot(self.position(i)) - p.offset - rate * t;
            gap < span * (GAINED - toward.min(0.0))
        };
        out.extend(planes.iter().filter(near));
    }
    /// Takes from velocities what would lead through the planes by the end of a step of `h` that begins at time `t`;
    /// Coulomb friction against the surface. What is sunken comes out at `recovery` m/s at most; where planes of one step
    /// push against each other, none moves it along the others: a skirt pinched between belly and shirt crept up under
    /// the shirt until it was gone (docs/hindsight.md).
    /// Returns how many vertices were touched.
    pub fn resolve_contacts(
        &mut self,
        planes: &[ContactPlane],
        t: f32,
        h: f32,
        recovery: f32,
    ) -> usize {
        let mut touched = 0;
        for p in planes {
            let i = p.vertex as usize;
            let rate = p.normal.dot(p.velocity);
            let gap = p.normal.dot(self.position(i)) - p.offset - rate * t;
            let v = self.velocity[i];
            let toward = p.normal.dot(v) - rate;
            // Above the surface a step may just reach it; below, it may not go deeper.
            let least = -gap.max(0.0) / h;
            if toward < least {
                let push = least - toward;
                let slip = v - p.velocity - p.normal.scale(toward);
                let speed = slip.dot(slip).sqrt();
                let kept = if speed > 0.0 {
                    (1.0 - p.friction * push / speed).max(0.0)
                } else {
                    0.0
                };
                // `toward` is relative to the surface: its own speed comes back with the normal part.
                self.velocity[i] = p.velocity + p.normal.scale(least) + slip.scale(kept);
                touched += 1;
            }
            if gap < 0.0 {
                let before = self.scratch.pressed[i];
                let against = before.dot(p.normal);
                let mut push = p.normal.scale((-gap * RECOVERED).min(recovery * h));
                if against < 0.0 {
                    push = push + p.normal.scale(against) - before;
                }
                self.displacement[i] = self.displacement[i] + push;
                self.scratch.pressed[i] = before + push;
                self.scratch.sunken.push(p.vertex);
            }
        }
        touched
    }
    /// Brings tied vertices to their places at the end of a step of `h` that begins at time `t`.
    pub fn apply_pins(&mut self, ties: &[Pin], t: f32, h: f32) {
        for a in ties {
            let i = a.vertex as usize;
            let wanted = (a.target + a.velocity.scale(t + h) - self.position(i)).scale(1.0 / h);
            let v = self.velocity[i];
            self.velocity[i] = v + (wanted - v).scale(a.stiffness);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a vertex at the origin goes in one step between planes with these normals that it is 1 cm under, metres.
    fn pushed(normals: &[[f32; 2]]) -> V4 {
        let mut m = PatchState::default();
        m.reset([V4::default()].into_iter(), [V4::default()].into_iter());
        for n in normals {
            let normal = V4::new(n[0], n[1], 0.0);
            m.resolve_contacts(
                &[ContactPlane {
                    normal,
                    offset: 0.01,
                    ..ContactPlane::default()
                }],
                0.0,
                1e-3,
                1.0,
            );
        }
        m.displacement[0]
    }

    #[test]
    fn a_vertex_pressed_from_two_sides_is_not_squeezed_out_between_them() {
        let way = 1e-3; // a step at 1 m/s
        for angle in [0.0f32, 0.1, 0.5, 1.0, 1.5] {
            let shirt = [-angle.cos(), angle.sin()];
            let V4([x, y, z, _]) = pushed(&[shirt, [1.0, 0.0]]);
            // The belly says how far out it goes; up, where the shirt leans to, it does not go.
            let out = way * (1.0 - angle.cos());
            assert!(
                (x - out).abs() < 1e-9 && y.abs() < 1e-9 && z == 0.0,
                "{angle}: {x} {y}"
            );
        }
        let right = pushed(&[[0.0, 1.0], [1.0, 0.0]]);
        assert_eq!(right, V4::new(way, way, 0.0), "in a corner both push");
    }
}
