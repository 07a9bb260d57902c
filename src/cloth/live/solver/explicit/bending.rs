//! Bending forces and drag of the air, kept for several substeps because they change slowly.

use super::active_set::{active_ranges, clip};
use super::air::Airflow;
use super::blocks::{HingeBlock, lowest};
use super::dispatch::wide;
use super::patch_model::PatchModel;
use super::patch_state::{PatchScratch, PatchState};
use super::simd::{Simd8, Slot, add3, dot, mul_add3, rsqrt, scale3, sub3};
use super::vec4::{MAX_VERTICES, SLOT_MASK, V4};

/// Square of the shortest Σ cₖ xₖ of a hinge that has a direction (m²).
const SMALLEST: f32 = 1e-24;

impl PatchState {
    /// Evaluates bending and drag within `rings` rings of the owned vertices; they are kept until the next evaluation.
    /// Positions are extrapolated by `lookahead` (s), half of the time that forces will be kept.
    pub fn update_bending(&mut self, f: &PatchModel, lookahead: f32, rings: usize) {
        wide!(bending_kernel(self, f: &PatchModel, lookahead: f32, rings: usize));
    }
}

#[inline(always)]
fn bending_kernel<L: Simd8>(
    state: &mut PatchState,
    l: L,
    f: &PatchModel,
    lookahead: f32,
    rings: usize,
) {
    let end = f.reach(rings);
    let PatchScratch {
        refiltered,
        acceleration,
        bending,
        active,
        ..
    } = &mut state.scratch;
    let n = bending.len();
    let whole = 0..n;
    let involved = active_ranges(active, &whole, |a| &a.involved);
    let (x, out): (&mut [V4; MAX_VERTICES], &mut [V4; MAX_VERTICES]) = (refiltered, acceleration);
    for r in involved {
        let r = clip(r, n);
        let all = state.start[r.clone()]
            .iter()
            .zip(&state.displacement[r.clone()])
            .zip(&state.velocity[r.clone()]);
        for (a, ((s, m), v)) in x[r.clone()].iter_mut().zip(all) {
            *a = *s + *m + v.scale(lookahead);
        }
        out[r].fill(V4::default());
    }
    let rows = (0..end, 0);
    let rows = active
        .as_ref()
        .map_or(std::slice::from_ref(&rows), |a| &a.bend[..]);
    for (r, first) in rows {
        let r = clip(r, end);
        add_pairs(r.clone(), &f.bend_count[r], &f.bend[*first..], x, out);
    }
    let last = f.bent.partition_point(|b| lowest(&b.v) < end);
    let all = 0..last;
    for r in active_ranges(active, &all, |a| &a.bent) {
        for b in &f.bent[clip(r, last)] {
            add_curved(l, b, x, out);
        }
    }
    let flow = Airflow {
        x,
        v: &state.velocity,
    };
    flow.add(f, active, end, out);
    for r in involved {
        let r = clip(r, n);
        bending[r.clone()].copy_from_slice(&out[r]);
    }
}

/// Adds the forces of hinges that are flat at rest: springs of length zero between pairs of vertices.
#[inline(always)]
fn add_pairs(
    vertices: std::ops::Range<usize>,
    counts: &[u16],
    mut pairs: &[(Slot, f32)],
    x: &[V4; MAX_VERTICES],
    out: &mut [V4; MAX_VERTICES],
) {
    for (i, count) in vertices.zip(counts) {
        let Some((row, after)) = pairs.split_at_checked(usize::from(*count)) else {
            break;
        };
        pairs = after;
        let here = x[i & SLOT_MASK];
        let mut sum = out[i & SLOT_MASK];
        for (j, w) in row {
            let pull = (here - j.get(x)).scale(*w);
            sum = sum + pull;
            j.set(out, j.get(out) - pull);
        }
        out[i & SLOT_MASK] = sum;
    }
}

/// Adds the forces of eight hinges that are bent at rest.
#[inline(always)]
fn add_curved<L: Simd8>(
    l: L,
    b: &HingeBlock,
    x: &[V4; MAX_VERTICES],
    out: &mut [V4; MAX_VERTICES],
) {
    // The coefficients sum to zero: differences lose no digits.
    let [p, q, r] = [l.load(&b.c[0]), l.load(&b.c[1]), l.load(&b.c[2])];
    let bow = scale3(l, l.edge_vectors(x, &b.v[0], &b.v[1]), p);
    let bow = mul_add3(l, l.edge_vectors(x, &b.v[0], &b.v[2]), q, bow);
    let bow = mul_add3(l, l.edge_vectors(x, &b.v[0], &b.v[3]), r, bow);
    let inverse = rsqrt(l, l.max(dot(l, bow, bow), l.splat(SMALLEST)));
    let more = l.mul_sub(l.load(&b.rest), inverse, l.splat(1.0));
    let pull = scale3(l, bow, l.mul(l.load(&b.w), more));
    let (j, k, m) = (scale3(l, pull, p), scale3(l, pull, q), scale3(l, pull, r));
    let all = add3(l, add3(l, j, k), m);
    l.scatter_add(out, &b.v[0], sub3(l, [l.splat(0.0); 3], all));
    l.scatter_add(out, &b.v[1], j);
    l.scatter_add(out, &b.v[2], k);
    l.scatter_add(out, &b.v[3], m);
}
