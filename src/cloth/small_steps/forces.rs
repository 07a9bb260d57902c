//! The inner loop: forces of a sheet, and velocities after a step.

use super::contact::{Plane, Tie};
use super::fabric::{Fabric, MOST, Row};
use super::lanes::{self, Lanes, Place, add3, dot, inverse_root, scale3, sub3};
use super::motion::{Motion, V4, Work};

/// One small step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
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
/// No number of 15 bits is beyond this: tables need no check.
const MASK: usize = MOST - 1;

/// Calls a kernel, compiled for wider registers where the processor has them.
macro_rules! wide {
    ($self:ident.$kernel:ident($($arg:ident: $kind:ty),*)) => {{
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx2")]
            fn avx2(m: &mut Motion, l: lanes::Avx2, $($arg: $kind),*) {
                m.$kernel(l, $($arg),*);
            }
            match lanes::detect() {
                // Sound: the processor has just been asked.
                #[allow(unsafe_code)]
                Some(l) => unsafe { avx2($self, l, $($arg),*) },
                None => $self.$kernel(lanes::Plain, $($arg),*),
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        $self.$kernel(lanes::Plain, $($arg),*);
    }};
}

/// M⁻¹L of one vertex, of which `own` is the value.
#[inline(always)]
fn laplacian(y: &[V4; MOST], r: &Row, own: V4) -> V4 {
    let [a, b, c, d, e, f] = r.near;
    let [p, q, s, t, u, v] = r.by;
    let near = ((a.get(y).scale(p) + b.get(y).scale(q)) + c.get(y).scale(s))
        + ((d.get(y).scale(t) + e.get(y).scale(u)) + f.get(y).scale(v));
    own.scale(r.own) - near
}

impl Motion {
    /// Bending forces, kept until called again, on what lies `rings` rings around the vertices that the patch owns. They
    /// change slowly (docs/benchmarks.md); `late` is how far ahead of the positions they are taken, s, half of the time
    /// they will be kept.
    pub fn bend(&mut self, f: &Fabric, late: f32, rings: usize) {
        wide!(self.bend_kernel(f: &Fabric, late: f32, rings: usize));
    }
    /// Velocities after a step under inner forces, gravity and air. Planes and ties are only answered where
    /// accelerations are smoothed: they must still be enforced. The same bits with and without AVX2, which is used where
    /// there is one.
    pub fn accelerate(&mut self, f: &Fabric, step: &Step, planes: &[Plane], ties: &[Tie]) {
        wide!(self.pull_kernel(f: &Fabric, step: &Step));
        if f.smoothing.len() > 1 {
            self.answer(f, planes, ties, step);
            wide!(self.smooth_kernel(f: &Fabric, step: &Step));
        } else {
            wide!(self.hasten_kernel(f: &Fabric, step: &Step));
        }
        self.work.looked = false;
    }
    #[inline(always)]
    fn look_ahead(&mut self, time: f32) {
        let all = self.work.ahead.0.iter_mut().zip(&self.start).zip(&self.moved).zip(&self.velocity);
        for (((a, s), m), v) in all {
            *a = *s + *m + v.scale(time);
        }
    }
    /// Positions after a step, none faster than `fastest` m/s: where planes contradict each other, speeds would grow
    /// until they are no numbers. The next step must be as long and look as far ahead.
    pub fn advance(&mut self, f: &Fabric, step: &Step, fastest: f32) {
        wide!(self.advance_kernel(f: &Fabric, step: &Step, fastest: f32));
        self.work.looked = true;
    }
    #[inline(always)]
    fn advance_kernel(&mut self, _: impl Lanes, f: &Fabric, step: &Step, fastest: f32) {
        let (h, ahead, most) = (step.h, step.h * step.ahead, fastest * fastest);
        let n = f.reach(step.rings);
        let all = self.moved[..n].iter_mut().zip(&mut self.velocity).zip(&self.start);
        for (((m, v), s), a) in all.zip(self.work.ahead.0.iter_mut()) {
            let square = v.dot(*v);
            if square > most {
                *v = v.scale(fastest / square.sqrt());
            }
            *m = *m + v.scale(h);
            *a = *s + *m + v.scale(ahead);
        }
    }

    /// Elastic accelerations and gravity into `push`.
    #[inline(always)]
    pub(super) fn pull_kernel<L: Lanes>(&mut self, l: L, f: &Fabric, step: &Step) {
        if !self.work.looked {
            self.look_ahead(step.h * step.ahead);
        }
        let Work { ahead, push, bending, .. } = &mut self.work;
        let (x, push) = (&*ahead.0, &mut *push.0);
        let rings = step.rings.saturating_add(f.smoothing.len() - 1);
        let n = f.reach(rings);
        // Triangles at the rim reach one ring further.
        let around = f.reach(rings.saturating_add(1));
        push[..around].copy_from_slice(&bending[..around]);
        let shortest = l.splat(SHORTEST * SHORTEST);
        let blocks = f.triangles.partition_point(|t| t.v[0][0].min(t.v[1][0]).min(t.v[2][0]).index() < n);
        for t in &f.triangles[..blocks] {
            // Two edges; the third closes the triangle.
            let e1 = l.between(x, &t.v[2], &t.v[0]);
            let e2 = l.between(x, &t.v[0], &t.v[1]);
            let e0 = add3(l, e1, e2);
            let square =
                [l.max(dot(l, e0, e0), shortest), l.max(dot(l, e1, e1), shortest), l.max(dot(l, e2, e2), shortest)];
            let inverse = [inverse_root(l, square[0]), inverse_root(l, square[1]), inverse_root(l, square[2])];
            let longer = [
                l.sub(l.mul(square[0], inverse[0]), l.load(&t.rest[0])),
                l.sub(l.mul(square[1], inverse[1]), l.load(&t.rest[1])),
                l.sub(l.mul(square[2], inverse[2]), l.load(&t.rest[2])),
            ];
            let [own0, own1, own2] = [l.load(&t.k[0]), l.load(&t.k[1]), l.load(&t.k[2])];
            let [k12, k20, k01] = [l.load(&t.k[3]), l.load(&t.k[4]), l.load(&t.k[5])];
            let tension = [
                l.mul(dot(l, [own0, k01, k20], longer), inverse[0]),
                l.mul(dot(l, [k01, own1, k12], longer), inverse[1]),
                l.mul(dot(l, [k20, k12, own2], longer), inverse[2]),
            ];
            let p2 = scale3(l, e2, tension[2]);
            let a = sub3(l, p2, scale3(l, e1, tension[1]));
            let b = add3(l, p2, scale3(l, e0, tension[0]));
            l.push(push, &t.v, a, b);
        }
        for (a, m) in push[..n].iter_mut().zip(&f.inverse_mass) {
            *a = a.scale(*m) + step.gravity;
        }
    }

    /// Velocities under accelerations that are not smoothed.
    #[inline(always)]
    fn hasten_kernel(&mut self, _: impl Lanes, f: &Fabric, step: &Step) {
        let keep = 1.0 / (1.0 + step.h * f.damping);
        let n = f.reach(step.rings);
        for (v, a) in self.velocity[..n].iter_mut().zip(self.work.push.0.iter()) {
            *v = (*v + a.scale(step.h)).scale(keep);
        }
    }

    /// W times `push` by Horner's scheme, and velocities under that.
    #[inline(always)]
    fn smooth_kernel(&mut self, _: impl Lanes, f: &Fabric, step: &Step) {
        let Work { push, smooth, smoother, held, .. } = &mut self.work;
        let Some((highest, lower)) = f.smoothing.split_last() else { return };
        let rounds = lower.len();
        let keep = 1.0 / (1.0 + step.h * f.damping);
        for (round, c) in lower.iter().rev().enumerate() {
            let n = f.reach(step.rings.saturating_add(rounds - 1 - round));
            // The first round takes the accelerations themselves, times the highest coefficient.
            let (y, out): (&[V4; MOST], &mut [V4; MOST]) = match round {
                0 => (&push.0, &mut smooth.0),
                _ => (&smooth.0, &mut smoother.0),
            };
            let scale = if round == 0 { *highest } else { 1.0 };
            if round + 1 == rounds {
                let all = self.velocity[..n].iter_mut().zip(&f.rows).zip(y.iter().zip(push.0.iter()));
                for ((v, r), (own, first)) in all {
                    let a = laplacian(y, r, *own).scale(scale) + first.scale(*c);
                    *v = (*v + a.scale(step.h)).scale(keep);
                }
                for e in &f.far {
                    let i = e.vertex.index();
                    if i < n {
                        let far = e.near.get(y).scale(e.by * scale * step.h * keep);
                        self.velocity[i] = self.velocity[i] - far;
                    }
                }
                return;
            }
            let all = out[..n].iter_mut().zip(&f.rows).zip(y.iter().zip(push.0.iter()));
            for ((o, r), (own, first)) in all {
                *o = laplacian(y, r, *own).scale(scale) + first.scale(*c);
            }
            for e in &f.far {
                let i = e.vertex.index();
                out[i] = out[i] - e.near.get(y).scale(e.by * scale);
            }
            for i in held.iter() {
                out[*i as usize & MASK] = V4::default();
            }
            if round > 0 {
                std::mem::swap(smooth, smoother);
            }
        }
    }

    #[inline(always)]
    fn bend_kernel(&mut self, _: impl Lanes, f: &Fabric, late: f32, rings: usize) {
        let end = f.reach(rings);
        let Work { smoother, push, bending, .. } = &mut self.work;
        for (((a, s), m), v) in smoother.0.iter_mut().zip(&self.start).zip(&self.moved).zip(&self.velocity) {
            *a = *s + *m + v.scale(late);
        }
        let x = &*smoother.0;
        let out = &mut push.0;
        let n = bending.len();
        out[..n].fill(V4::default());
        let mut rest = &f.bend[..];
        for (i, count) in f.bend_count[..end].iter().enumerate() {
            let Some((row, after)) = rest.split_at_checked(usize::from(*count)) else { break };
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
        for b in &f.bent {
            let [i, j, k, l] = b.v;
            if i.min(j).min(k).min(l).index() >= end {
                break;
            }
            let of = |v: Place| v.get(x) - i.get(x);
            // The coefficients sum to zero: differences lose no digits.
            let q = of(j).scale(b.c[1]) + (of(k).scale(b.c[2]) + of(l).scale(b.c[3]));
            let pull = q.scale(b.w * (b.rest / q.dot(q).sqrt().max(f32::MIN_POSITIVE) - 1.0));
            i.set(out, i.get(out) + pull.scale(b.c[0]));
            j.set(out, j.get(out) + pull.scale(b.c[1]));
            k.set(out, k.get(out) + pull.scale(b.c[2]));
            l.set(out, l.get(out) + pull.scale(b.c[3]));
        }
        bending.copy_from_slice(&out[..n]);
    }
}
