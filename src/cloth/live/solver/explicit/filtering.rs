//! Filtered accelerations, and velocities under them.

use super::active_set::{active_ranges, clip};
use super::patch_model::{FilterRow, PatchModel};
use super::patch_state::{PatchScratch, PatchState, Substep};
use super::simd::Simd8;
use super::vec4::{MAX_VERTICES, SLOT_MASK, V4};

/// One iteration of Horner's scheme: `scale` M⁻¹L y + `coefficient` a.
#[derive(Clone, Copy)]
struct Iteration {
    /// First iteration: y is the acceleration itself.
    first: bool,
    scale: f32,
    coefficient: f32,
    /// Vertices that later iterations need.
    reach: usize,
}

/// W times the accelerations by Horner's scheme, and velocities after a substep.
#[inline(always)]
pub(super) fn filter_kernel<L: Simd8>(
    state: &mut PatchState,
    l: L,
    f: &PatchModel,
    step: &Substep,
) {
    let Some((highest, lower)) = f.filter.split_last() else {
        return;
    };
    let degree = lower.len();
    for (k, c) in lower.iter().rev().enumerate() {
        let iteration = Iteration {
            first: k == 0,
            scale: if k == 0 { *highest } else { 1.0 },
            coefficient: *c,
            reach: f.reach(step.rings.saturating_add(degree - 1 - k)),
        };
        if k + 1 == degree {
            integrate_filtered(state, l, f, step, iteration);
        } else {
            filter_once(&mut state.scratch, l, f, iteration);
        }
    }
}

/// M⁻¹L of two vertices, of which `own` are the values.
#[inline(always)]
fn laplacian<L: Simd8>(l: L, y: &[V4; MAX_VERTICES], r: &FilterRow, own: L::F) -> L::F {
    let [a, b, c, d, e, f] = r.near;
    let [[p, q], [s, t], [u, v], [own_by, _]] = [
        l.broadcast_pairs(&r.by[0]),
        l.broadcast_pairs(&r.by[1]),
        l.broadcast_pairs(&r.by[2]),
        l.broadcast_pairs(&r.by[3]),
    ];
    let low = l.mul(l.gather_pair(y, a), p);
    let low = l.mul_add(l.gather_pair(y, b), q, low);
    let low = l.mul_add(l.gather_pair(y, c), s, low);
    let high = l.mul(l.gather_pair(y, d), t);
    let high = l.mul_add(l.gather_pair(y, e), u, high);
    let high = l.mul_add(l.gather_pair(y, f), v, high);
    l.mul_sub(own, own_by, l.add(low, high))
}

/// Vertices rounded up to pairs; an odd last one has a partner whose value is unused.
fn even(n: usize) -> usize {
    n.next_multiple_of(2)
}

/// Last iteration, straight into velocities.
#[inline(always)]
fn integrate_filtered<L: Simd8>(
    state: &mut PatchState,
    l: L,
    f: &PatchModel,
    step: &Substep,
    iteration: Iteration,
) {
    let PatchScratch {
        acceleration,
        filtered,
        active,
        ..
    } = &state.scratch;
    let Iteration {
        scale, reach: n, ..
    } = iteration;
    let keep = 1.0 / (1.0 + step.h * f.damping);
    let y: &[V4; MAX_VERTICES] = if iteration.first {
        acceleration
    } else {
        filtered
    };
    let (wide, by) = (l.splat(scale), l.splat(iteration.coefficient));
    let (h, kept) = (l.splat(step.h), l.splat(keep));
    let whole = 0..n;
    for r in active_ranges(active, &whole, |a| &a.vertices) {
        // Ranges of owned vertices begin at even numbers; an odd ghost is computed by its owner.
        let r = even(r.start).min(n)..r.end.min(n);
        let own = y[r.start..].as_chunks::<2>().0.iter();
        let pairs = f.filter_rows[r.start / 2..]
            .iter()
            .zip(own.zip(acceleration[r.start..].as_chunks::<2>().0));
        // The velocity of an odd last vertex has no partner.
        let (both, last) =
            state.velocity[r.start..even(r.end).min(f.vertices.len())].as_chunks_mut::<2>();
        let mut odd = [last.first().copied().unwrap_or_default(); 2];
        for (v, (r, (own, first))) in both.iter_mut().chain([&mut odd]).zip(pairs) {
            let own = l.load_pair(own);
            let a = l.mul_add(laplacian(l, y, r, own), wide, l.mul(l.load_pair(first), by));
            l.store_pair(l.mul(l.mul_add(a, h, l.load_pair(v)), kept), v);
        }
        last.iter_mut().for_each(|v| *v = odd[0]);
    }
    for e in &f.filter_overflow {
        let i = e.vertex.index();
        if i < n && !active.as_ref().is_some_and(|a| a.asleep[i]) {
            let far = e.near.get(y).scale(e.by * scale * step.h * keep);
            state.velocity[i] = state.velocity[i] - far;
        }
    }
}

/// Iteration before the last, into `filtered`.
#[inline(always)]
fn filter_once<L: Simd8>(scratch: &mut PatchScratch, l: L, f: &PatchModel, iteration: Iteration) {
    let PatchScratch {
        acceleration,
        filtered,
        refiltered,
        pinned,
        active,
        ..
    } = scratch;
    let (y, out): (&[V4; MAX_VERTICES], &mut [V4; MAX_VERTICES]) = if iteration.first {
        (&**acceleration, &mut **filtered)
    } else {
        (&**filtered, &mut **refiltered)
    };
    let Iteration {
        scale, reach: n, ..
    } = iteration;
    let (wide, by) = (l.splat(scale), l.splat(iteration.coefficient));
    let whole = 0..n;
    for r in active_ranges(active, &whole, |a| &a.vertices) {
        let r = r.start / 2 * 2..even(clip(r, n).end);
        if r.is_empty() {
            continue;
        }
        let own = y[r.start..].as_chunks::<2>().0.iter();
        let pairs = f.filter_rows[r.start / 2..]
            .iter()
            .zip(own.zip(acceleration[r.start..].as_chunks::<2>().0));
        for (o, (r, (own, first))) in out[r].as_chunks_mut::<2>().0.iter_mut().zip(pairs) {
            let own = l.load_pair(own);
            let a = l.mul_add(laplacian(l, y, r, own), wide, l.mul(l.load_pair(first), by));
            l.store_pair(a, o);
        }
    }
    for e in &f.filter_overflow {
        let i = e.vertex.index();
        out[i] = out[i] - e.near.get(y).scale(e.by * scale);
    }
    let rim = active.iter().flat_map(|a| &a.rim);
    rim.chain(pinned.iter())
        .for_each(|i| out[*i as usize & SLOT_MASK] = V4::default());
    if !iteration.first {
        std::mem::swap(filtered, refiltered);
    }
}
