//! Positions and velocities of one patch between two contact queries.

use super::active_set::ActiveSet;
use super::patch_model::PatchModel;
use super::vec4::{SlotArray, V4};

/// Vertices that speed limits leave as they are; shape `[vertices]` each.
#[derive(Clone, Copy, Debug)]
pub struct Exemptions<'a> {
    /// Vertices with a prescribed position.
    pub fixed: &'a [bool],
    /// Vertices that no limit applies to.
    pub unlimited: &'a [bool],
}

/// Input of one substep.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Substep {
    /// Length (s).
    pub h: f32,
    /// Time of its begin since the contact query (s).
    pub t: f32,
    /// Extrapolation of the positions that forces are evaluated at (substeps).
    pub lookahead: f32,
    /// m/s².
    pub gravity: V4,
    /// Rings around the owned vertices that must be right afterwards: 0 where halos are exchanged then.
    pub rings: usize,
}

/// State of a patch. Positions are split into start and displacement: a substep moves a vertex by less than the last digit
/// of its position.
#[derive(Clone, Debug, Default)]
pub struct PatchState {
    /// Positions at [`PatchState::reset`] (m).
    pub start: Vec<V4>,
    /// Displacement since then (m).
    pub displacement: Vec<V4>,
    /// m/s.
    pub velocity: Vec<V4>,
    pub(super) scratch: PatchScratch,
}

/// Arrays of the kernels.
#[derive(Clone, Debug)]
pub(super) struct PatchScratch {
    /// Extrapolated positions, where forces are evaluated.
    pub(super) predicted: SlotArray,
    /// Acceleration of each vertex, and its filtered values after each iteration of the filter.
    pub(super) acceleration: SlotArray,
    pub(super) filtered: SlotArray,
    pub(super) refiltered: SlotArray,
    pub(super) bending: Vec<V4>,
    /// True if `predicted` is current.
    pub(super) is_predicted: bool,
    /// Vertices with a rigid pin.
    pub(super) pinned: Vec<u32>,
    /// Displacement of penetrating vertices by contacts of this substep (m), and these vertices.
    pub(super) recovered: Vec<V4>,
    pub(super) penetrating: Vec<u32>,
    /// `None` if nothing sleeps.
    pub(super) active: Option<ActiveSet>,
}

impl Default for PatchScratch {
    fn default() -> Self {
        Self {
            predicted: SlotArray::new(0),
            acceleration: SlotArray::new(1),
            filtered: SlotArray::new(2),
            refiltered: SlotArray::new(3),
            bending: Vec::new(),
            is_predicted: false,
            pinned: Vec::new(),
            recovered: Vec::new(),
            penetrating: Vec::new(),
            active: None,
        }
    }
}

impl PatchState {
    /// Replaces positions (m) and velocities (m/s); nothing sleeps.
    pub fn reset(
        &mut self,
        positions: impl Iterator<Item = V4>,
        velocities: impl Iterator<Item = V4>,
    ) {
        self.start.clear();
        self.start.extend(positions);
        self.velocity.clear();
        self.velocity.extend(velocities);
        let n = self.start.len();
        self.scratch.is_predicted = false;
        self.scratch.active = None;
        self.scratch.penetrating.clear();
        for zeroed in [
            &mut self.displacement,
            &mut self.scratch.recovered,
            &mut self.scratch.bending,
        ] {
            zeroed.clear();
            zeroed.resize(n, V4::default());
        }
    }
    /// Excludes sleeping vertices from substeps until the next reset: they keep their velocity.
    pub fn set_sleeping(&mut self, f: &PatchModel, asleep: &[bool]) {
        self.scratch.active = asleep.contains(&true).then(|| ActiveSet::new(f, asleep));
    }
    /// Position of a vertex (m).
    #[inline(always)]
    pub fn position(&self, i: usize) -> V4 {
        self.start[i] + self.displacement[i]
    }
    /// Flags the ends of edges longer than `ratio` times their rest length.
    pub fn find_overstretched(&self, f: &PatchModel, ratio: f32, out: &mut Vec<bool>) {
        out.clear();
        out.resize(self.start.len(), false);
        for (e, rest) in f.ends.iter().zip(&f.rest) {
            let [i, j] = e.map(usize::from);
            let d = self.position(j) - self.position(i);
            if d.dot(d) > (ratio * rest) * (ratio * rest) {
                (out[i], out[j]) = (true, true);
            }
        }
    }
    /// Scales velocities above `limit` down to it (m/s).
    pub fn limit_speed(&mut self, limit: f32, except: &Exemptions<'_>) {
        let flags = except.fixed.iter().zip(except.unlimited);
        for (v, (fixed, unlimited)) in self.velocity.iter_mut().zip(flags) {
            let square = v.dot(*v);
            if !fixed && !unlimited && square > limit * limit {
                *v = v.scale(limit / square.sqrt());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_speed_scales_only_fast_vertices_without_exemption() {
        let v = |x: f32, y: f32| V4::new(x, y, 0.0);
        let [fast, slow] = [v(3.0, 4.0), v(0.3, 0.4)];
        let mut state = PatchState {
            velocity: vec![fast, slow, fast, fast, v(0.0, 0.0)],
            ..PatchState::default()
        };
        let except = Exemptions {
            fixed: &[false, false, true, false, false],
            unlimited: &[false, false, false, true, false],
        };
        state.limit_speed(0.5, &except);
        let speeds: Vec<f32> = state.velocity.iter().map(|v| v.dot(*v).sqrt()).collect();
        assert_eq!(speeds, [0.5, 0.5, 5.0, 5.0, 0.0]);
        assert!(
            (state.velocity[0].0[0] - 0.3).abs() < 1e-6,
            "same direction"
        );
    }
}
