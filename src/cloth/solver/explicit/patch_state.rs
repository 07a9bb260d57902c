//! The state of one sheet between two outer calls, and one small step of it.

use super::active_set::ActiveSet;
use super::patch_model::{MOST, PatchModel};
use crate::math::P3;

/// Four floats that load at once: x, y, z and a spare lane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(16))]
pub struct V4(pub [f32; 4]);

impl V4 {
    /// From three numbers.
    #[inline(always)]
    pub fn new(x: f32, y: f32, z: f32) -> Self {
        Self([x, y, z, 0.0])
    }
    /// The first three as a place.
    #[inline(always)]
    pub fn point(self) -> P3 {
        P3::new(self.0[0], self.0[1], self.0[2])
    }
    /// Inner product of the first three.
    #[inline(always)]
    pub fn dot(self, o: Self) -> f32 {
        self.0[0] * o.0[0] + self.0[1] * o.0[1] + self.0[2] * o.0[2]
    }
    /// All lanes times a number.
    #[inline(always)]
    pub fn scale(self, s: f32) -> Self {
        Self(self.0.map(|c| c * s))
    }
}

impl std::ops::Add for V4 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self([
            self.0[0] + o.0[0],
            self.0[1] + o.0[1],
            self.0[2] + o.0[2],
            self.0[3] + o.0[3],
        ])
    }
}

impl std::ops::Sub for V4 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self([
            self.0[0] - o.0[0],
            self.0[1] - o.0[1],
            self.0[2] - o.0[2],
            self.0[3] - o.0[3],
        ])
    }
}

/// One vector for every [`super::simd::Place`]: such an index needs no check.
#[derive(Clone, Debug)]
pub(super) struct Table {
    all: Vec<V4>,
    from: usize,
}

/// So many vectors lie between the beginnings of two tables, beside whole pages: a processor takes a load for one of what
/// was just stored where both addresses end in the same 12 bits, and waits.
const APART: usize = 72;

impl Table {
    fn new(number: usize) -> Self {
        // Zeroed memory is lent page by page when it is touched, so a small patch does not cost what a large one does.
        let from = number * APART;
        Self {
            all: vec![V4::default(); MOST + from],
            from,
        }
    }
}

impl std::ops::Deref for Table {
    type Target = [V4; MOST];
    #[inline(always)]
    fn deref(&self) -> &[V4; MOST] {
        self.all[self.from..]
            .first_chunk()
            .expect("it was made so long")
    }
}

impl std::ops::DerefMut for Table {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [V4; MOST] {
        self.all[self.from..]
            .first_chunk_mut()
            .expect("it was made so long")
    }
}

/// Vertices that fold limits and speed limits leave as they are; shape `[vertices]` each.
#[derive(Clone, Copy, Debug)]
pub struct Exemptions<'a> {
    /// Vertices with a prescribed position.
    pub fixed: &'a [bool],
    /// Vertices that no limit applies to.
    pub unlimited: &'a [bool],
}

/// Positions are kept as a start plus how far they have moved since: a small step moves less than a position's last
/// digit, and would be lost.
#[derive(Clone, Debug, Default)]
pub struct PatchState {
    /// Where the outer call began, metres.
    pub start: Vec<V4>,
    /// Moved since, metres.
    pub displacement: Vec<V4>,
    /// m/s.
    pub velocity: Vec<V4>,
    pub(super) scratch: Scratch,
}

/// Scratch of the inner loop.
#[derive(Clone, Debug)]
pub(super) struct Scratch {
    /// Where forces are evaluated: a little ahead.
    pub(super) ahead: Table,
    /// Acceleration of each vertex, and what becomes of it by smoothing.
    pub(super) push: Table,
    pub(super) smooth: Table,
    pub(super) smoother: Table,
    pub(super) bending: Vec<V4>,
    /// Whether `ahead` is where the next step needs it.
    pub(super) looked: bool,
    /// Vertices whose place is given.
    pub(super) held: Vec<u32>,
    /// What contacts of this step have pushed sunken vertices by, metres, and which these are.
    pub(super) pressed: Vec<V4>,
    pub(super) sunken: Vec<u32>,
    /// What is computed; everything, if nothing sleeps.
    pub(super) awake: Option<ActiveSet>,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            ahead: Table::new(0),
            push: Table::new(1),
            smooth: Table::new(2),
            smoother: Table::new(3),
            bending: Vec::new(),
            looked: false,
            held: Vec::new(),
            pressed: Vec::new(),
            sunken: Vec::new(),
            awake: None,
        }
    }
}

impl PatchState {
    /// Begins an outer call.
    pub fn reset(
        &mut self,
        positions: impl Iterator<Item = V4>,
        velocities: impl Iterator<Item = V4>,
    ) {
        self.start.clear();
        self.start.extend(positions);
        self.velocity.clear();
        self.velocity.extend(velocities);
        self.displacement.clear();
        self.displacement.resize(self.start.len(), V4::default());
        self.scratch.looked = false;
        self.scratch.awake = None;
        self.scratch.pressed.clear();
        self.scratch.pressed.resize(self.start.len(), V4::default());
        self.scratch.sunken.clear();
        self.scratch.bending.clear();
        self.scratch.bending.resize(self.start.len(), V4::default());
    }
    /// Position of a vertex.
    #[inline(always)]
    pub fn position(&self, i: usize) -> V4 {
        self.start[i] + self.displacement[i]
    }
    /// Marks the vertices of edges that are longer than `most` times their rest length.
    pub fn find_overstretched(&self, f: &PatchModel, most: f32, out: &mut Vec<bool>) {
        out.clear();
        out.resize(self.start.len(), false);
        for (e, rest) in f.ends.iter().zip(&f.rest) {
            let [i, j] = e.map(usize::from);
            let d = self.position(j) - self.position(i);
            if d.dot(d) > (most * rest) * (most * rest) {
                (out[i], out[j]) = (true, true);
            }
        }
    }
    /// No vertex stays faster than `most` m/s.
    pub fn limit_speed(&mut self, most: f32, except: &Exemptions<'_>) {
        for ((v, held), free) in self
            .velocity
            .iter_mut()
            .zip(except.fixed)
            .zip(except.unlimited)
        {
            let square = v.dot(*v);
            if !held && !free && square > most * most {
                *v = v.scale(most / square.sqrt());
            }
        }
    }
    /// Velocities after a step of `h` under bending, gravity and air alone.
    pub fn integrate_external(&mut self, f: &PatchModel, h: f32, gravity: V4) {
        let keep = 1.0 / (1.0 + h * f.damping);
        let fall = gravity.scale(h);
        for ((v, a), m) in self
            .velocity
            .iter_mut()
            .zip(&self.scratch.bending)
            .zip(&f.inverse_mass)
        {
            *v = (*v + a.scale(m * h) + fall).scale(keep);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_fast_and_free_to_go_slower_is_slowed_down() {
        let v = |x: f32, y: f32| V4::new(x, y, 0.0);
        let mut motion = PatchState {
            velocity: vec![
                v(3.0, 4.0),
                v(0.3, 0.4),
                v(3.0, 4.0),
                v(3.0, 4.0),
                v(0.0, 0.0),
            ],
            ..PatchState::default()
        };
        let (held, free) = (
            [false, false, true, false, false],
            [false, false, false, true, false],
        );
        motion.limit_speed(
            0.5,
            &Exemptions {
                fixed: &held,
                unlimited: &free,
            },
        );
        let speeds: Vec<f32> = motion.velocity.iter().map(|v| v.dot(*v).sqrt()).collect();
        assert_eq!(speeds, [0.5, 0.5, 5.0, 5.0, 0.0]);
        // The way stays the same.
        assert!((motion.velocity[0].0[0] - 0.3).abs() < 1e-6);
    }
}
