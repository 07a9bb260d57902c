//! The inner loop: forces of a sheet, and velocities after a step.

use super::active_set::{before, part};
use super::contact::{ContactPlane, Pin};
use super::patch_model::{MOST, PatchModel, Rows};
use super::patch_state::{PatchState, Scratch, V4};
use super::simd::{self, Lanes, add3, dot, inverse_root, mul_add3, scale3, sub3};

/// One small step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Substep {
    /// Length, s.
    pub h: f32,
    /// When it begins, since the planes and ties were found, s.
    pub t: f32,
    /// How far ahead of positions forces are evaluated, in steps.
    pub ahead: f32,
    /// m/s².
    pub gravity: V4,
    /// How many rings around the vertices that a patch owns must be right after it: 0 where patches meet then.
    pub rings: usize,
}

/// Shortest length of an edge that still has a direction, metres.
const SHORTEST: f32 = 1e-6;
/// Square of the bow of a hinge that still has a direction, m².
const SMALLEST: f32 = 1e-24;
/// No number of 15 bits is beyond this: tables need no check.
const MASK: usize = MOST - 1;

/// Calls a kernel, compiled for wider registers where the processor has them.
macro_rules! wide {
    ($self:ident.$kernel:ident($($arg:ident: $kind:ty),*)) => {{
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx2,fma")]
            fn avx2(m: &mut PatchState, l: simd::Avx2, $($arg: $kind),*) {
                m.$kernel(l, $($arg),*);
            }
            match simd::detect() {
                // Sound: the processor has just been asked.
                #[allow(unsafe_code)]
                Some(l) => unsafe { avx2($self, l, $($arg),*) },
                None => $self.$kernel(simd::Plain, $($arg),*),
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        $self.$kernel(simd::Plain, $($arg),*);
    }};
}

/// 1 / length of edges and how much longer than at rest they are.
#[inline(always)]
fn spring<L: Lanes>(
    l: L,
    edge: [L::F; 3],
    rest: &[f32; simd::LANES],
    shortest: L::F,
) -> (L::F, L::F) {
    let square = l.max(dot(l, edge, edge), shortest);
    let inverse = inverse_root(l, square);
    (inverse, l.mul_sub(square, inverse, l.load(rest)))
}

/// M⁻¹L of two vertices, of which `own` are the values.
#[inline(always)]
fn laplacian<L: Lanes>(l: L, y: &[V4; MOST], r: &Rows, own: L::F) -> L::F {
    let [a, b, c, d, e, f] = r.near;
    let [[p, q], [s, t], [u, v], [own_by, _]] = [
        l.each(&r.by[0]),
        l.each(&r.by[1]),
        l.each(&r.by[2]),
        l.each(&r.by[3]),
    ];
    let low = l.mul(l.pair(y, a), p);
    let low = l.mul_add(l.pair(y, b), q, low);
    let low = l.mul_add(l.pair(y, c), s, low);
    let high = l.mul(l.pair(y, d), t);
    let high = l.mul_add(l.pair(y, e), u, high);
    let high = l.mul_add(l.pair(y, f), v, high);
    l.mul_sub(own, own_by, l.add(low, high))
}

/// So many vertices and one more where they are odd: its value is not needed, and there is room for it.
fn even(n: usize) -> usize {
    n.next_multiple_of(2)
}

impl PatchState {
    /// Bending forces, kept until called again, on what lies `rings` rings around the vertices that the patch owns. They
    /// change slowly (docs/benchmarks.md); `late` is how far ahead of the positions they are taken, s, half of the time
    /// they will be kept.
    pub fn update_bending(&mut self, f: &PatchModel, late: f32, rings: usize) {
        wide!(self.bend_kernel(f: &PatchModel, late: f32, rings: usize));
    }
    /// Velocities after a step under inner forces, gravity and air. Planes and ties are only answered where
    /// accelerations are smoothed: they must still be enforced. The same bits with and without AVX2, which is used where
    /// there is one.
    pub fn integrate_velocities(
        &mut self,
        f: &PatchModel,
        step: &Substep,
        planes: &[ContactPlane],
        ties: &[Pin],
    ) {
        wide!(self.elastic_kernel(f: &PatchModel, step: &Substep));
        if f.smoothing.len() > 1 {
            self.predict_contacts(f, planes, ties, step);
            wide!(self.smooth_kernel(f: &PatchModel, step: &Substep));
        } else {
            wide!(self.integrate_velocity(f: &PatchModel, step: &Substep));
        }
        self.scratch.looked = false;
    }
    #[inline(always)]
    fn look_ahead(&mut self, time: f32) {
        let all = self
            .scratch
            .ahead
            .iter_mut()
            .zip(&self.start)
            .zip(&self.displacement)
            .zip(&self.velocity);
        for (((a, s), m), v) in all {
            *a = *s + *m + v.scale(time);
        }
    }
    /// Positions after a step, none faster than `fastest` m/s: where planes contradict each other, speeds would grow
    /// until they are no numbers. The next step must be as long and look as far ahead.
    pub fn integrate_positions(&mut self, f: &PatchModel, step: &Substep, fastest: f32) {
        wide!(self.advance_kernel(f: &PatchModel, step: &Substep, fastest: f32));
        self.scratch.looked = true;
    }
    #[inline(always)]
    fn advance_kernel(&mut self, _: impl Lanes, f: &PatchModel, step: &Substep, fastest: f32) {
        let (h, ahead, most) = (step.h, step.h * step.ahead, fastest * fastest);
        let n = f.reach(step.rings);
        let Scratch {
            ahead: look,
            awake,
            pressed,
            sunken,
            ..
        } = &mut self.scratch;
        sunken
            .drain(..)
            .for_each(|i| pressed[i as usize] = V4::default());
        let whole = 0..n;
        for r in part(awake, &whole, |a| &a.vertices) {
            let r = before(r, n);
            let all = self.displacement[r.clone()]
                .iter_mut()
                .zip(&mut self.velocity[r.clone()])
                .zip(&self.start[r.clone()]);
            for (((m, v), s), a) in all.zip(look[r].iter_mut()) {
                let square = v.dot(*v);
                if square > most {
                    *v = v.scale(fastest / square.sqrt());
                }
                *m = *m + v.scale(h);
                *a = *s + *m + v.scale(ahead);
            }
        }
        for i in awake.iter().flat_map(|a| &a.rim).map(|i| *i as usize) {
            self.displacement[i] = self.displacement[i] + self.velocity[i].scale(h);
            look[i & MASK] = self.start[i] + self.displacement[i] + self.velocity[i].scale(ahead);
        }
    }

    /// Elastic accelerations and gravity into `push`.
    #[inline(always)]
    pub(super) fn elastic_kernel<L: Lanes>(&mut self, l: L, f: &PatchModel, step: &Substep) {
        if !self.scratch.looked {
            self.look_ahead(step.h * step.ahead);
        }
        let Scratch {
            ahead,
            push,
            bending,
            awake,
            ..
        } = &mut self.scratch;
        let (x, push): (&[V4; MOST], &mut [V4; MOST]) = (ahead, push);
        let rings = step.rings.saturating_add(f.smoothing.len() - 1);
        let n = f.reach(rings);
        // Pairs of triangles at the rim reach two rings further.
        let around = f.reach(rings.saturating_add(2));
        let (whole, whole_n) = (0..around, 0..n);
        for r in part(awake, &whole, |a| &a.seen) {
            let r = before(r, around);
            push[r.clone()].copy_from_slice(&bending[r]);
        }
        let shortest = l.splat(SHORTEST * SHORTEST);
        let blocks = f.quads.partition_point(|q| q.lowest() < n);
        let all = 0..blocks;
        for r in part(awake, &all, |a| &a.quads) {
            for q in &f.quads[before(r, blocks)] {
                let ab = l.between(x, &q.v[0], &q.v[1]);
                let ac = l.between(x, &q.v[0], &q.v[2]);
                let ad = l.between(x, &q.v[0], &q.v[3]);
                let (bc, bd) = (sub3(l, ac, ab), sub3(l, ad, ab));
                let (ab1, ab2) = spring(l, ab, &q.rest[0], shortest);
                let (ac1, ac2) = spring(l, ac, &q.rest[1], shortest);
                let (bc1, bc2) = spring(l, bc, &q.rest[2], shortest);
                let (ad1, ad2) = spring(l, ad, &q.rest[3], shortest);
                let (bd1, bd2) = spring(l, bd, &q.rest[4], shortest);
                let [k0, k1, k2, k3, k4] = [
                    l.load(&q.k[0]),
                    l.load(&q.k[1]),
                    l.load(&q.k[2]),
                    l.load(&q.k[3]),
                    l.load(&q.k[4]),
                ];
                let [k01, k02, k03, k04] = [
                    l.load(&q.k[5]),
                    l.load(&q.k[6]),
                    l.load(&q.k[7]),
                    l.load(&q.k[8]),
                ];
                let [k12, k34] = [l.load(&q.k[9]), l.load(&q.k[10])];
                // Tensions over lengths.
                let t0 = l.mul_add(
                    k04,
                    bd2,
                    l.mul_add(k03, ad2, dot(l, [k0, k01, k02], [ab2, ac2, bc2])),
                );
                let t0 = l.mul(t0, ab1);
                let t1 = l.mul(dot(l, [k01, k1, k12], [ab2, ac2, bc2]), ac1);
                let t2 = l.mul(dot(l, [k02, k12, k2], [ab2, ac2, bc2]), bc1);
                let t3 = l.mul(dot(l, [k03, k3, k34], [ab2, ad2, bd2]), ad1);
                let t4 = l.mul(dot(l, [k04, k34, k4], [ab2, ad2, bd2]), bd1);
                let c = mul_add3(l, ac, t1, scale3(l, bc, t2));
                let d = mul_add3(l, ad, t3, scale3(l, bd, t4));
                let a = mul_add3(l, ab, t0, mul_add3(l, ac, t1, scale3(l, ad, t3)));
                // All that pulls at c and d, and what pulls at a is taken from that.
                let b = sub3(l, add3(l, c, d), a);
                let zero = l.splat(0.0);
                l.put(push, &q.v[0], a);
                l.put(push, &q.v[1], b);
                l.put(push, &q.v[2], sub3(l, [zero; 3], c));
                l.put(push, &q.v[3], sub3(l, [zero; 3], d));
            }
        }
        for r in part(awake, &whole_n, |a| &a.vertices) {
            let r = before(r, n);
            for (a, m) in push[r.clone()].iter_mut().zip(&f.inverse_mass[r]) {
                *a = a.scale(*m) + step.gravity;
            }
        }
        // What sleeps has no acceleration to be smoothed.
        awake
            .iter()
            .flat_map(|a| &a.rim)
            .for_each(|i| push[*i as usize & MASK] = V4::default());
    }

    /// Velocities under accelerations that are not smoothed.
    #[inline(always)]
    fn integrate_velocity(&mut self, _: impl Lanes, f: &PatchModel, step: &Substep) {
        let keep = 1.0 / (1.0 + step.h * f.damping);
        let n = f.reach(step.rings);
        let Scratch { push, awake, .. } = &self.scratch;
        let whole = 0..n;
        for r in part(awake, &whole, |a| &a.vertices) {
            let r = before(r, n);
            for (v, a) in self.velocity[r.clone()].iter_mut().zip(&push[r]) {
                *v = (*v + a.scale(step.h)).scale(keep);
            }
        }
    }

    /// W times `push` by Horner's scheme, and velocities under that.
    #[inline(always)]
    fn smooth_kernel<L: Lanes>(&mut self, l: L, f: &PatchModel, step: &Substep) {
        let Scratch {
            push,
            smooth,
            smoother,
            held,
            awake,
            ..
        } = &mut self.scratch;
        let Some((highest, lower)) = f.smoothing.split_last() else {
            return;
        };
        let rounds = lower.len();
        let keep = 1.0 / (1.0 + step.h * f.damping);
        for (round, c) in lower.iter().rev().enumerate() {
            let n = f.reach(step.rings.saturating_add(rounds - 1 - round));
            // The first round takes the accelerations themselves, times the highest coefficient.
            let (y, out): (&[V4; MOST], &mut [V4; MOST]) = match round {
                0 => (&**push, &mut **smooth),
                _ => (&**smooth, &mut **smoother),
            };
            let scale = if round == 0 { *highest } else { 1.0 };
            let (wide, by) = (l.splat(scale), l.splat(*c));
            let whole = 0..n;
            let stretches = part(awake, &whole, |a| &a.vertices);
            let sleeps = |i: usize| awake.as_ref().is_some_and(|a| a.asleep[i]);
            if round + 1 == rounds {
                let (h, kept) = (l.splat(step.h), l.splat(keep));
                for r in stretches {
                    // Two by two: stretches of what a patch owns begin at even places, and what others own they compute.
                    let r = even(r.start).min(n)..r.end.min(n);
                    let pairs = f.rows[r.start / 2..].iter().zip(
                        y[r.start..]
                            .as_chunks::<2>()
                            .0
                            .iter()
                            .zip(push[r.start..].as_chunks::<2>().0),
                    );
                    // The velocity of an odd last vertex has no partner.
                    let (both, last) = self.velocity[r.start..even(r.end).min(f.vertices.len())]
                        .as_chunks_mut::<2>();
                    let mut odd = [last.first().copied().unwrap_or_default(); 2];
                    for (v, (r, (own, first))) in both.iter_mut().chain([&mut odd]).zip(pairs) {
                        let own = l.load_pair(own);
                        let a =
                            l.mul_add(laplacian(l, y, r, own), wide, l.mul(l.load_pair(first), by));
                        l.store_pair(l.mul(l.mul_add(a, h, l.load_pair(v)), kept), v);
                    }
                    last.iter_mut().for_each(|v| *v = odd[0]);
                }
                for e in &f.far {
                    let i = e.vertex.index();
                    if i < n && !sleeps(i) {
                        let far = e.near.get(y).scale(e.by * scale * step.h * keep);
                        self.velocity[i] = self.velocity[i] - far;
                    }
                }
                return;
            }
            for r in stretches {
                let r = r.start / 2 * 2..even(r.end.min(n));
                if r.is_empty() {
                    continue;
                }
                let pairs = f.rows[r.start / 2..].iter().zip(
                    y[r.start..]
                        .as_chunks::<2>()
                        .0
                        .iter()
                        .zip(push[r.start..].as_chunks::<2>().0),
                );
                for (o, (r, (own, first))) in out[r].as_chunks_mut::<2>().0.iter_mut().zip(pairs) {
                    let own = l.load_pair(own);
                    let a = l.mul_add(laplacian(l, y, r, own), wide, l.mul(l.load_pair(first), by));
                    l.store_pair(a, o);
                }
            }
            for e in &f.far {
                let i = e.vertex.index();
                out[i] = out[i] - e.near.get(y).scale(e.by * scale);
            }
            awake
                .iter()
                .flat_map(|a| &a.rim)
                .for_each(|i| out[*i as usize & MASK] = V4::default());
            for i in held.iter() {
                out[*i as usize & MASK] = V4::default();
            }
            if round > 0 {
                std::mem::swap(smooth, smoother);
            }
        }
    }

    #[inline(always)]
    fn bend_kernel<L: Lanes>(&mut self, l: L, f: &PatchModel, late: f32, rings: usize) {
        let end = f.reach(rings);
        let Scratch {
            smoother,
            push,
            bending,
            awake,
            ..
        } = &mut self.scratch;
        let n = bending.len();
        let whole = 0..n;
        let seen = part(awake, &whole, |a| &a.seen);
        let out: &mut [V4; MOST] = push;
        for r in seen {
            let r = before(r, n);
            let all = self.start[r.clone()]
                .iter()
                .zip(&self.displacement[r.clone()])
                .zip(&self.velocity[r.clone()]);
            for (a, ((s, m), v)) in smoother[r.clone()].iter_mut().zip(all) {
                *a = *s + *m + v.scale(late);
            }
            out[r].fill(V4::default());
        }
        let x: &[V4; MOST] = smoother;
        let rows = (0..end, 0);
        for (r, from) in awake
            .as_ref()
            .map_or(std::slice::from_ref(&rows), |a| &a.bend[..])
        {
            let r = before(r, end);
            let mut rest = &f.bend[*from..];
            for (i, count) in r.clone().zip(&f.bend_count[r]) {
                let Some((row, after)) = rest.split_at_checked(usize::from(*count)) else {
                    break;
                };
                rest = after;
                let here = x[i & MASK];
                let mut sum = out[i & MASK];
                for (j, w) in row {
                    let pull = (here - j.get(x)).scale(*w);
                    sum = sum + pull;
                    j.set(out, j.get(out) - pull);
                }
                out[i & MASK] = sum;
            }
        }
        let (least, one) = (l.splat(SMALLEST), l.splat(1.0));
        let last = f.bent.partition_point(|b| b.lowest() < end);
        let all = 0..last;
        let blocks = part(awake, &all, |a| &a.bent);
        for r in blocks {
            for b in &f.bent[before(r, last)] {
                // The coefficients sum to zero: differences lose no digits.
                let [p, q, r] = [l.load(&b.c[0]), l.load(&b.c[1]), l.load(&b.c[2])];
                let bow = scale3(l, l.between(x, &b.v[0], &b.v[1]), p);
                let bow = mul_add3(l, l.between(x, &b.v[0], &b.v[2]), q, bow);
                let bow = mul_add3(l, l.between(x, &b.v[0], &b.v[3]), r, bow);
                let inverse = inverse_root(l, l.max(dot(l, bow, bow), least));
                let more = l.mul_sub(l.load(&b.rest), inverse, one);
                let pull = scale3(l, bow, l.mul(l.load(&b.w), more));
                let (j, k, m) = (scale3(l, pull, p), scale3(l, pull, q), scale3(l, pull, r));
                let all = add3(l, add3(l, j, k), m);
                let zero = l.splat(0.0);
                l.put(out, &b.v[0], sub3(l, [zero; 3], all));
                l.put(out, &b.v[1], j);
                l.put(out, &b.v[2], k);
                l.put(out, &b.v[3], m);
            }
        }
        for r in seen {
            let r = before(r, n);
            bending[r.clone()].copy_from_slice(&out[r]);
        }
    }
}
