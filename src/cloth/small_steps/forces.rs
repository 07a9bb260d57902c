//! The inner loop: forces of a sheet, and velocities after a step.

use super::contact::{Plane, Tie};
use super::fabric::{BLOCK, Fabric, MOST};
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
}

/// Shortest length of an edge that still has a direction, metres.
const SHORTEST: f32 = 1e-6;
/// No number of 16 bits is beyond this: tables need no check.
const MASK: usize = MOST - 1;

/// Calls a kernel, compiled for wider registers where the processor has them.
macro_rules! wide {
    ($self:ident.$kernel:ident($($arg:ident: $kind:ty),*)) => {{
        #[cfg(target_arch = "x86_64")]
        {
            #[target_feature(enable = "avx2")]
            fn avx2(m: &mut Motion, $($arg: $kind),*) {
                m.$kernel($($arg),*);
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                // Sound: the processor has just been asked.
                #[allow(unsafe_code)]
                unsafe {
                    avx2($self, $($arg),*);
                }
            } else {
                $self.$kernel($($arg),*);
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        $self.$kernel($($arg),*);
    }};
}

impl Motion {
    /// Bending forces, kept until called again. They change slowly (docs/benchmarks.md);
    /// `late` is how far ahead of the positions they are taken, s, half of the time they will be kept.
    pub fn bend(&mut self, f: &Fabric, late: f32) {
        wide!(self.bend_kernel(f: &Fabric, late: f32));
    }
    /// Velocities after a step under inner forces, gravity and air. Planes and ties are only answered where
    /// accelerations are smoothed: they must still be enforced. The same bits with and without AVX2, which is used where there is one.
    pub fn accelerate(&mut self, f: &Fabric, step: &Step, planes: &[Plane], ties: &[Tie]) {
        wide!(self.pull_kernel(f: &Fabric, step: &Step));
        if f.smoothing.len() > 1 {
            self.answer(planes, ties, step);
            wide!(self.smooth_kernel(f: &Fabric));
        }
        let keep = 1.0 / (1.0 + step.h * f.damping);
        let push = if f.smoothing.len() > 1 { &self.work.smooth.0 } else { &self.work.push.0 };
        for (v, a) in self.velocity.iter_mut().zip(push.iter()) {
            *v = (*v + a.scale(step.h)).scale(keep);
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
    pub fn advance(&mut self, step: &Step, fastest: f32) {
        wide!(self.advance_kernel(step: &Step, fastest: f32));
        self.work.looked = true;
    }
    #[inline(always)]
    fn advance_kernel(&mut self, step: &Step, fastest: f32) {
        let (h, ahead, most) = (step.h, step.h * step.ahead, fastest * fastest);
        let all = self.moved.iter_mut().zip(&mut self.velocity).zip(&self.start).zip(self.work.ahead.0.iter_mut());
        for (((m, v), s), a) in all {
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
    fn pull_kernel(&mut self, f: &Fabric, step: &Step) {
        if !self.work.looked {
            self.look_ahead(step.h * step.ahead);
        }
        let Work { ahead, pull, longer, tension, push, bending, .. } = &mut self.work;
        let x = &*ahead.0;
        let edges = f.rest.len();
        // Rows are filled up with the edge after the last, which pulls nothing.
        pull.0[edges & MASK] = V4::default();
        let (mut e0, mut i0) = (0, 0);
        for (k, [e1, i1]) in f.ready.iter().map(|r| r.map(|n| n as usize)).enumerate() {
            let block = k * BLOCK..((k + 1) * BLOCK).min(edges);
            let (d, l, t) = (&mut pull.0[block.clone()], &mut longer.0[block.clone()], &mut tension.0[block.clone()]);
            for (d, [a, b]) in d.iter_mut().zip(&f.ends[block.clone()]) {
                *d = x[usize::from(*b)] - x[usize::from(*a)];
            }
            for (((d, l), t), r) in d.iter().zip(l).zip(t).zip(&f.rest[block]) {
                let length = d.dot(*d).sqrt().max(SHORTEST);
                *t = 1.0 / length;
                *l = length - r;
            }
            let all = longer.0[e0..e1].iter().zip(&f.couple[e0..e1]);
            for ((d, t), (own, c)) in pull.0[e0..e1].iter_mut().zip(&tension.0[e0..e1]).zip(all) {
                let of = |k: usize| c.by[k] * longer.0[usize::from(c.edge[k])];
                *d = d.scale(t * (c.own * own + ((of(0) + of(1)) + (of(2) + of(3)))));
            }
            let all = bending[i0..i1].iter().zip(&f.inverse_mass[i0..i1]);
            for ((a, r), (b, m)) in push.0[i0..i1].iter_mut().zip(&f.rows[i0..i1]).zip(all) {
                let of = |k: usize| pull.0[usize::from(r.edges[k])];
                let sum = *b + (((of(0) + of(1)) + of(2)) - ((of(3) + of(4)) + of(5)));
                *a = sum.scale(*m) + step.gravity;
            }
            (e0, i0) = (e1, i1);
        }
        for e in &f.extra {
            let i = usize::from(e.vertex);
            let m = f.inverse_mass.get(i).copied().unwrap_or(0.0);
            push.0[i] = push.0[i] + pull.0[usize::from(e.edge)].scale(e.sign * m);
        }
    }

    /// W times `push` into `smooth`, by Horner's scheme.
    #[inline(always)]
    fn smooth_kernel(&mut self, f: &Fabric) {
        let Work { push, smooth, smoother, held, .. } = &mut self.work;
        let Some((last, lower)) = f.smoothing.split_last() else { return };
        let mut scale = *last;
        for (round, c) in lower.iter().rev().enumerate() {
            // The first round takes the accelerations themselves, times the highest coefficient.
            let (y, out): (&[V4; MOST], &mut [V4; MOST]) = match round {
                0 => (&push.0, &mut smooth.0),
                _ => (&smooth.0, &mut smoother.0),
            };
            for (i, (r, o)) in f.rows.iter().zip(out.iter_mut()).enumerate() {
                let of = |k: usize| y[usize::from(r.near[k])].scale(r.by[k]);
                let near = ((of(0) + of(1)) + of(2)) + ((of(3) + of(4)) + of(5));
                *o = (y[i & MASK].scale(r.own) - near).scale(scale) + push.0[i & MASK].scale(*c);
            }
            for e in &f.far {
                let i = usize::from(e.vertex);
                out[i] = out[i] - y[usize::from(e.near)].scale(e.by * scale);
            }
            scale = 1.0;
            for i in held.iter() {
                out[*i as usize & MASK] = V4::default();
            }
            if round > 0 {
                std::mem::swap(smooth, smoother);
            }
        }
    }

    #[inline(always)]
    fn bend_kernel(&mut self, f: &Fabric, late: f32) {
        let Work { smoother, push, bending, .. } = &mut self.work;
        for (((a, s), m), v) in smoother.0.iter_mut().zip(&self.start).zip(&self.moved).zip(&self.velocity) {
            *a = *s + *m + v.scale(late);
        }
        let x = &*smoother.0;
        let out = &mut push.0;
        let n = bending.len();
        out[..n].fill(V4::default());
        let mut rest = &f.bend[..];
        for (i, count) in f.bend_count.iter().enumerate() {
            let Some((row, after)) = rest.split_at_checked(usize::from(*count)) else { break };
            rest = after;
            let here = x[i & MASK];
            let mut sum = out[i & MASK];
            for (j, w) in row {
                let j = usize::from(*j);
                let pull = (here - x[j]).scale(*w);
                sum = sum + pull;
                out[j] = out[j] - pull;
            }
            out[i & MASK] = sum;
        }
        for b in &f.bent {
            let [i, j, k, l] = b.v.map(usize::from);
            // The coefficients sum to zero: differences lose no digits.
            let q = (x[j] - x[i]).scale(b.c[1]) + ((x[k] - x[i]).scale(b.c[2]) + (x[l] - x[i]).scale(b.c[3]));
            let pull = q.scale(b.w * (b.rest / q.dot(q).sqrt().max(f32::MIN_POSITIVE) - 1.0));
            out[i] = out[i] + pull.scale(b.c[0]);
            out[j] = out[j] + pull.scale(b.c[1]);
            out[k] = out[k] + pull.scale(b.c[2]);
            out[l] = out[l] + pull.scale(b.c[3]);
        }
        bending.copy_from_slice(&out[..n]);
    }
}
