//! Symplectic Euler: velocities under accelerations, then positions under velocities.

use super::active_set::{active_ranges, clip};
use super::constraint::Pin;
use super::contact::VertexPlanes;
use super::dispatch::wide;
use super::elastic::elastic_kernel;
use super::filtering::filter_kernel;
use super::patch_model::PatchModel;
use super::patch_state::{PatchScratch, PatchState, Substep};
use super::simd::Simd8;
use super::vec4::{SLOT_MASK, V4};

impl PatchState {
    /// Velocities after a substep under inner forces, gravity and air drag. Contacts and pins only correct accelerations
    /// before the filter; they must still be enforced. AVX2 gives the same bits as its absence.
    pub fn integrate_velocities(
        &mut self,
        f: &PatchModel,
        step: &Substep,
        planes: &VertexPlanes,
        pins: &[Pin],
    ) {
        wide!(elastic_kernel(self, f: &PatchModel, step: &Substep));
        if f.filter.len() > 1 {
            self.predict_contacts(f, planes, pins, step);
            wide!(filter_kernel(self, f: &PatchModel, step: &Substep));
        } else {
            wide!(integrate_velocity(self, f: &PatchModel, step: &Substep));
        }
        self.scratch.is_predicted = false;
    }
    /// Positions after a substep. No vertex moves faster than `max_speed` (m/s): contradicting planes would raise speeds
    /// beyond all numbers. The next substep must have the same length and lookahead.
    pub fn integrate_positions(&mut self, f: &PatchModel, step: &Substep, max_speed: f32) {
        wide!(integrate_position(self, f: &PatchModel, step: &Substep, max_speed: f32));
        self.scratch.is_predicted = true;
    }
}

/// Velocities under unfiltered accelerations.
#[inline(always)]
fn integrate_velocity(state: &mut PatchState, _: impl Simd8, f: &PatchModel, step: &Substep) {
    let keep = 1.0 / (1.0 + step.h * f.damping);
    let n = f.reach(step.rings);
    let PatchScratch {
        acceleration,
        active,
        ..
    } = &state.scratch;
    let whole = 0..n;
    for r in active_ranges(active, &whole, |a| &a.vertices) {
        let r = clip(r, n);
        for (v, a) in state.velocity[r.clone()].iter_mut().zip(&acceleration[r]) {
            *v = (*v + a.scale(step.h)).scale(keep);
        }
    }
}

#[inline(always)]
fn integrate_position(
    state: &mut PatchState,
    _: impl Simd8,
    f: &PatchModel,
    step: &Substep,
    max_speed: f32,
) {
    let (h, ahead, limit) = (step.h, step.h * step.lookahead, max_speed * max_speed);
    let n = f.reach(step.rings);
    let PatchScratch {
        predicted,
        active,
        recovered,
        penetrating,
        ..
    } = &mut state.scratch;
    penetrating
        .drain(..)
        .for_each(|i| recovered[i as usize] = V4::default());
    let whole = 0..n;
    for r in active_ranges(active, &whole, |a| &a.vertices) {
        let r = clip(r, n);
        let all = state.displacement[r.clone()]
            .iter_mut()
            .zip(&mut state.velocity[r.clone()])
            .zip(&state.start[r.clone()]);
        for (((m, v), s), a) in all.zip(predicted[r].iter_mut()) {
            let square = v.dot(*v);
            if square > limit {
                *v = v.scale(max_speed / square.sqrt());
            }
            *m = *m + v.scale(h);
            *a = *s + *m + v.scale(ahead);
        }
    }
    let rim = active.iter().flat_map(|a| &a.rim);
    for i in rim.map(|i| *i as usize) {
        state.displacement[i] = state.displacement[i] + state.velocity[i].scale(h);
        predicted[i & SLOT_MASK] =
            state.start[i] + state.displacement[i] + state.velocity[i].scale(ahead);
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_sheets::{Lab, cotton, crumpled, grid, sheet};
    use super::*;
    use crate::live::solver::explicit::simd::{LANES, Scalar, rsqrt};
    use tryon_geometry::math::V3d;

    #[test]
    fn wide_registers_give_the_bits_of_scalar_code() {
        let (x, faces, rest) = grid(9, 7, 0.02, 0.013);
        let wild = crumpled(&x);
        let make = || {
            let mut lab = Lab::new(sheet(&faces, &rest, x.len(), &cotton(1e-5)), &x, 1e-4, 1);
            lab.place(&wild, &vec![V3d::new(0.1, 0.0, 0.3); x.len()]);
            lab
        };
        let step = Substep {
            h: 1e-4,
            lookahead: 0.25,
            ..Substep::default()
        };
        let (mut scalar, mut wide) = (make(), make());
        elastic_kernel(&mut scalar.states[0], Scalar, &scalar.models[0], &step);
        wide.states[0].integrate_velocities(&wide.models[0], &step, &VertexPlanes::default(), &[]);
        let [scalar, wide] =
            [&scalar, &wide].map(|lab| &lab.states[0].scratch.acceleration[..x.len()]);
        assert!(scalar.iter().any(|a| a.dot(*a) > 1.0));
        assert!(scalar == wide);
    }

    #[test]
    fn reciprocal_square_root_is_accurate_to_single_precision() {
        let numbers: [f32; LANES] = [1e-12, 1e-7, 2.5e-4, 0.9, 1.0, 1.7, 4.1, 3e5];
        for (a, y) in numbers.iter().zip(rsqrt(Scalar, numbers)) {
            let product = f64::from(y) * f64::from(*a).sqrt();
            assert!((product - 1.0).abs() < 1e-6, "{a}: {y}");
        }
    }
}
