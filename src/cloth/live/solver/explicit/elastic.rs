//! Elastic accelerations of the membrane.

use super::active_set::{active_ranges, clip};
use super::blocks::{QuadBlock, lowest};
use super::patch_model::PatchModel;
use super::patch_state::{PatchScratch, PatchState, Substep};
use super::simd::{LANES, Simd8, add3, dot, mul_add3, rsqrt, scale3, sub3};
use super::vec4::{MAX_VERTICES, SLOT_MASK, V4};

/// Shortest length of an edge that has a direction (m).
const SHORTEST: f32 = 1e-6;

/// Elastic accelerations and gravity into `acceleration`.
#[inline(always)]
pub(super) fn elastic_kernel<L: Simd8>(
    state: &mut PatchState,
    l: L,
    f: &PatchModel,
    step: &Substep,
) {
    if !state.scratch.is_predicted {
        predict(state, step.h * step.lookahead);
    }
    let PatchScratch {
        predicted,
        acceleration,
        bending,
        active,
        ..
    } = &mut state.scratch;
    let (x, out): (&[V4; MAX_VERTICES], &mut [V4; MAX_VERTICES]) = (predicted, acceleration);
    let rings = step.rings.saturating_add(f.filter.len() - 1);
    let n = f.reach(rings);
    // Pairs of triangles at the rim reach two rings further.
    let around = f.reach(rings.saturating_add(2));
    let (whole, whole_n) = (0..around, 0..n);
    for r in active_ranges(active, &whole, |a| &a.involved) {
        let r = clip(r, around);
        out[r.clone()].copy_from_slice(&bending[r]);
    }
    let blocks = f.quads.partition_point(|q| lowest(&q.v) < n);
    let all = 0..blocks;
    for r in active_ranges(active, &all, |a| &a.quads) {
        for q in &f.quads[clip(r, blocks)] {
            add_tensions(l, q, x, out);
        }
    }
    for r in active_ranges(active, &whole_n, |a| &a.vertices) {
        let r = clip(r, n);
        for (a, m) in out[r.clone()].iter_mut().zip(&f.inverse_mass[r]) {
            *a = a.scale(*m) + step.gravity;
        }
    }
    // Sleeping vertices have no acceleration to be filtered.
    active
        .iter()
        .flat_map(|a| &a.rim)
        .for_each(|i| out[*i as usize & SLOT_MASK] = V4::default());
}

#[inline(always)]
fn predict(state: &mut PatchState, time: f32) {
    let (start, displacement) = (&state.start, &state.displacement);
    let all = state.scratch.predicted.iter_mut().zip(start);
    for (((a, s), m), v) in all.zip(displacement).zip(&state.velocity) {
        *a = *s + *m + v.scale(time);
    }
}

/// 1 / length of edges, and their lengthening (m).
#[inline(always)]
fn spring<L: Simd8>(l: L, edge: [L::F; 3], rest: &[f32; LANES]) -> (L::F, L::F) {
    let square = l.max(dot(l, edge, edge), l.splat(SHORTEST * SHORTEST));
    let inverse = rsqrt(l, square);
    (inverse, l.mul_sub(square, inverse, l.load(rest)))
}

/// Adds the tensions of eight pairs of triangles a b c and b a d to the forces at their corners.
#[inline(always)]
fn add_tensions<L: Simd8>(
    l: L,
    q: &QuadBlock,
    x: &[V4; MAX_VERTICES],
    out: &mut [V4; MAX_VERTICES],
) {
    let ab = l.edge_vectors(x, &q.v[0], &q.v[1]);
    let ac = l.edge_vectors(x, &q.v[0], &q.v[2]);
    let ad = l.edge_vectors(x, &q.v[0], &q.v[3]);
    let (bc, bd) = (sub3(l, ac, ab), sub3(l, ad, ab));
    let (ab1, ab2) = spring(l, ab, &q.rest[0]);
    let (ac1, ac2) = spring(l, ac, &q.rest[1]);
    let (bc1, bc2) = spring(l, bc, &q.rest[2]);
    let (ad1, ad2) = spring(l, ad, &q.rest[3]);
    let (bd1, bd2) = spring(l, bd, &q.rest[4]);
    let [k0, k1, k2] = [l.load(&q.k[0]), l.load(&q.k[1]), l.load(&q.k[2])];
    let [k3, k4] = [l.load(&q.k[3]), l.load(&q.k[4])];
    let [k01, k02] = [l.load(&q.k[5]), l.load(&q.k[6])];
    let [k03, k04] = [l.load(&q.k[7]), l.load(&q.k[8])];
    let [k12, k34] = [l.load(&q.k[9]), l.load(&q.k[10])];
    // Tensions over lengths.
    let t0 = dot(l, [k0, k01, k02], [ab2, ac2, bc2]);
    let t0 = l.mul_add(k04, bd2, l.mul_add(k03, ad2, t0));
    let t0 = l.mul(t0, ab1);
    let t1 = l.mul(dot(l, [k01, k1, k12], [ab2, ac2, bc2]), ac1);
    let t2 = l.mul(dot(l, [k02, k12, k2], [ab2, ac2, bc2]), bc1);
    let t3 = l.mul(dot(l, [k03, k3, k34], [ab2, ad2, bd2]), ad1);
    let t4 = l.mul(dot(l, [k04, k34, k4], [ab2, ad2, bd2]), bd1);
    let c = mul_add3(l, ac, t1, scale3(l, bc, t2));
    let d = mul_add3(l, ad, t3, scale3(l, bd, t4));
    let a = mul_add3(l, ab, t0, mul_add3(l, ac, t1, scale3(l, ad, t3)));
    // The four forces sum to zero.
    let b = sub3(l, add3(l, c, d), a);
    let zero = [l.splat(0.0); 3];
    l.scatter_add(out, &q.v[0], a);
    l.scatter_add(out, &q.v[1], b);
    l.scatter_add(out, &q.v[2], sub3(l, zero, c));
    l.scatter_add(out, &q.v[3], sub3(l, zero, d));
}
