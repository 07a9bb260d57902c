//! The state of one sheet between two outer calls, and one small step of it.

use super::fabric::{Fabric, MOST};

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
        Self([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2], self.0[3] + o.0[3]])
    }
}

impl std::ops::Sub for V4 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2], self.0[3] - o.0[3]])
    }
}

/// One value for every index of 16 bits: such an index needs no check.
#[derive(Clone, Debug)]
struct Table<T>(Box<[T; MOST]>);

impl<T: Copy + Default> Default for Table<T> {
    fn default() -> Self {
        // Zeroed memory is lent page by page when it is touched, so a small patch does not cost what a large one does.
        match vec![T::default(); MOST].into_boxed_slice().try_into() {
            Ok(t) => Self(t),
            Err(_) => unreachable!("the length is MOST"),
        }
    }
}

/// Positions are kept as a start plus how far they have moved since: a small step moves less than a position's last
/// digit, and would be lost.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// Where the outer call began, metres.
    pub start: Vec<V4>,
    /// Moved since, metres.
    pub moved: Vec<V4>,
    /// m/s.
    pub velocity: Vec<V4>,
    /// Where forces are evaluated: a little ahead.
    ahead: Table<V4>,
    force: Table<V4>,
    longer: Table<f32>,
    tension: Table<f32>,
    bending: Vec<V4>,
}

/// Shortest length of an edge that still has a direction, metres.
const SHORTEST: f32 = 1e-6;

impl Motion {
    /// Begins an outer call.
    pub fn begin(&mut self, positions: impl Iterator<Item = V4>, velocities: impl Iterator<Item = V4>) {
        self.start.clear();
        self.start.extend(positions);
        self.velocity.clear();
        self.velocity.extend(velocities);
        self.moved.clear();
        self.moved.resize(self.start.len(), V4::default());
        self.bending.clear();
        self.bending.resize(self.start.len(), V4::default());
    }
    /// Position of a vertex.
    #[inline(always)]
    pub fn position(&self, i: usize) -> V4 {
        self.start[i] + self.moved[i]
    }
    #[inline(always)]
    fn look_ahead(&mut self, time: f32) {
        let all = self.ahead.0.iter_mut().zip(&self.start).zip(&self.moved).zip(&self.velocity);
        for (((a, s), m), v) in all {
            *a = *s + *m + v.scale(time);
        }
    }
    /// Marks the vertices of edges that are longer than `most` times their rest length.
    pub fn overstretched(&self, f: &Fabric, most: f32, out: &mut Vec<bool>) {
        out.clear();
        out.resize(self.start.len(), false);
        let mut edges = f.other.iter().zip(&f.rest);
        for (i, count) in f.count.iter().enumerate() {
            for (j, rest) in edges.by_ref().take(usize::from(*count)) {
                let d = self.position(usize::from(*j)) - self.position(i);
                if d.dot(d) > (most * rest) * (most * rest) {
                    (out[i], out[usize::from(*j)]) = (true, true);
                }
            }
        }
    }
    /// Bending forces, kept until called again. They change slowly: every fourth step is enough (docs/benchmarks.md);
    /// `late` is how far ahead of the positions they are taken, s, half of the time they will be kept.
    pub fn bend(&mut self, f: &Fabric, late: f32) {
        self.look_ahead(late);
        let x = &*self.ahead.0;
        let out = &mut self.force.0;
        let n = self.start.len();
        out[..n].fill(V4::default());
        let mut rest = &f.bend[..];
        for (i, count) in f.bend_count.iter().enumerate() {
            let Some((row, after)) = rest.split_at_checked(usize::from(*count)) else { break };
            rest = after;
            let here = x[i];
            let mut sum = out[i];
            for (j, w) in row {
                let j = usize::from(*j);
                let pull = (here - x[j]).scale(*w);
                sum = sum + pull;
                out[j] = out[j] - pull;
            }
            out[i] = sum;
        }
        for b in &f.bent {
            let mut q = V4::default();
            for k in 0..4 {
                q = q + x[usize::from(b.v[k])].scale(b.c[k]);
            }
            let pull = b.pull / q.dot(q).sqrt().max(f32::MIN_POSITIVE);
            for k in 0..4 {
                let v = usize::from(b.v[k]);
                out[v] = out[v] + q.scale(pull * b.c[k]);
            }
        }
        self.bending.clear();
        self.bending.extend_from_slice(&out[..n]);
    }
    /// Velocities after a step of `h` under inner forces, gravity (m/s²) and air. `ahead` in steps. The same bits with
    /// and without AVX2, which is used where there is one.
    pub fn accelerate(&mut self, f: &Fabric, h: f32, ahead: f32, gravity: V4) {
        #[cfg(target_arch = "x86_64")]
        {
            /// The same text, compiled for wider registers.
            #[target_feature(enable = "avx2")]
            fn wide(m: &mut Motion, f: &Fabric, h: f32, ahead: f32, gravity: V4) {
                m.accelerate_kernel(f, h, ahead, gravity);
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                // Sound: the processor has just been asked.
                #[allow(unsafe_code)]
                unsafe {
                    wide(self, f, h, ahead, gravity);
                }
                return;
            }
        }
        self.accelerate_kernel(f, h, ahead, gravity);
    }

    #[inline(always)]
    fn accelerate_kernel(&mut self, f: &Fabric, h: f32, ahead: f32, gravity: V4) {
        self.look_ahead(h * ahead);
        let x = &*self.ahead.0;
        let n = self.start.len();
        // Squared lengths.
        let mut first = 0usize;
        for (i, count) in f.count.iter().enumerate() {
            let to = first + usize::from(*count);
            let here = x[i & (MOST - 1)];
            for (j, l) in f.other[first..to].iter().zip(&mut self.longer.0[first..to]) {
                let d = x[usize::from(*j)] - here;
                *l = d.dot(d);
            }
            first = to;
        }
        let edges = f.rest.len();
        for ((l, t), r) in self.longer.0[..edges].iter_mut().zip(&mut self.tension.0[..edges]).zip(&f.rest) {
            let length = l.sqrt().max(SHORTEST);
            *t = 1.0 / length;
            *l = length - r;
        }
        let longer = &*self.longer.0;
        for ((t, c), own) in self.tension.0[..edges].iter_mut().zip(&f.couple).zip(&longer[..edges]) {
            let of = |k: usize| c.by[k] * longer[usize::from(c.edge[k])];
            *t *= c.own * own + ((of(0) + of(1)) + (of(2) + of(3)));
        }
        let force = &mut self.force.0;
        force[..n].copy_from_slice(&self.bending);
        first = 0;
        for (i, count) in f.count.iter().enumerate() {
            let to = first + usize::from(*count);
            let here = x[i & (MOST - 1)];
            let mut sum = force[i & (MOST - 1)];
            for (j, t) in f.other[first..to].iter().zip(&self.tension.0[first..to]) {
                let j = usize::from(*j);
                let pull = (x[j] - here).scale(*t);
                sum = sum + pull;
                force[j] = force[j] - pull;
            }
            force[i & (MOST - 1)] = sum;
            first = to;
        }
        let keep = 1.0 / (1.0 + h * f.damping);
        let fall = gravity.scale(h);
        for ((v, a), m) in self.velocity.iter_mut().zip(&force[..n]).zip(&f.inverse_mass) {
            *v = (*v + a.scale(m * h) + fall).scale(keep);
        }
    }
    /// Velocities after a step of `h` under bending, gravity and air alone.
    pub fn fall(&mut self, f: &Fabric, h: f32, gravity: V4) {
        let keep = 1.0 / (1.0 + h * f.damping);
        let fall = gravity.scale(h);
        for ((v, a), m) in self.velocity.iter_mut().zip(&self.bending).zip(&f.inverse_mass) {
            *v = (*v + a.scale(m * h) + fall).scale(keep);
        }
    }
    /// Positions after a step of `h`, none faster than `fastest` m/s: where planes contradict each other, speeds would
    /// grow until they are no numbers.
    pub fn advance(&mut self, h: f32, fastest: f32) {
        for (m, v) in self.moved.iter_mut().zip(&mut self.velocity) {
            let square = v.dot(*v);
            if square > fastest * fastest {
                *v = v.scale(fastest / square.sqrt());
            }
            *m = *m + v.scale(h);
        }
    }
}
