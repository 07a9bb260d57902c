//! Operations on eight floats, and vector algebra on them.

use super::slot::{LANES, Slot, Slots};
use crate::live::solver::explicit::vec4::{MAX_VERTICES, V4};

/// Arithmetic, gathers and scatters on eight floats.
pub(in super::super) trait Simd8: Copy {
    /// Eight floats.
    type F: Copy;
    fn load(self, a: &[f32; LANES]) -> Self::F;
    fn splat(self, a: f32) -> Self::F;
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// a b + c, rounded once.
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// a b − c, rounded once.
    fn mul_sub(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// c − a b, rounded once.
    fn sub_mul(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// `magic` minus half of the bits of positive numbers: the initial value of a reciprocal square root.
    fn rsqrt_guess(self, a: Self::F, magic: u32) -> Self::F;
    /// Components of x[b] − x[a].
    fn edge_vectors(self, x: &[V4; MAX_VERTICES], a: &Slots, b: &Slots) -> [Self::F; 3];
    /// Adds vectors to the contents of eight slots, lane by lane.
    fn scatter_add(self, out: &mut [V4; MAX_VERTICES], at: &Slots, a: [Self::F; 3]);
    /// Vectors of two slots, side by side.
    fn gather_pair(self, x: &[V4; MAX_VERTICES], at: [Slot; 2]) -> Self::F;
    /// Two consecutive vectors.
    fn load_pair(self, x: &[V4; 2]) -> Self::F;
    /// Inverse of [`Simd8::load_pair`].
    fn store_pair(self, x: Self::F, to: &mut [V4; 2]);
    /// One float for each of two vectors, twice.
    fn broadcast_pairs(self, a: &[[f32; 2]; 2]) -> [Self::F; 2];
}

// No closures here nor in the kernels: they would be compiled separately, without the wide registers.

/// Inner product of three components.
#[inline(always)]
pub(in super::super) fn dot<L: Simd8>(l: L, a: [L::F; 3], b: [L::F; 3]) -> L::F {
    l.mul_add(a[2], b[2], l.mul_add(a[1], b[1], l.mul(a[0], b[0])))
}

/// Sum, component by component.
#[inline(always)]
pub(in super::super) fn add3<L: Simd8>(l: L, a: [L::F; 3], b: [L::F; 3]) -> [L::F; 3] {
    [l.add(a[0], b[0]), l.add(a[1], b[1]), l.add(a[2], b[2])]
}

/// Difference, component by component.
#[inline(always)]
pub(in super::super) fn sub3<L: Simd8>(l: L, a: [L::F; 3], b: [L::F; 3]) -> [L::F; 3] {
    [l.sub(a[0], b[0]), l.sub(a[1], b[1]), l.sub(a[2], b[2])]
}

/// Vectors times numbers plus vectors, each rounded once.
#[inline(always)]
pub(in super::super) fn mul_add3<L: Simd8>(l: L, a: [L::F; 3], s: L::F, b: [L::F; 3]) -> [L::F; 3] {
    [
        l.mul_add(a[0], s, b[0]),
        l.mul_add(a[1], s, b[1]),
        l.mul_add(a[2], s, b[2]),
    ]
}

/// Vectors times numbers.
#[inline(always)]
pub(in super::super) fn scale3<L: Simd8>(l: L, a: [L::F; 3], s: L::F) -> [L::F; 3] {
    [l.mul(a[0], s), l.mul(a[1], s), l.mul(a[2], s)]
}

/// Reciprocal square root of positive numbers, to 7e-7: two Newton iterations, the first with the constants of Moroz et
/// al. 2018 (after Kadlec). The exact instructions take three times as long.
#[inline(always)]
pub(in super::super) fn rsqrt<L: Simd8>(l: L, a: L::F) -> L::F {
    const MAGIC: u32 = 0x5F1F_FFF9;
    const FIRST: [f32; 2] = [0.703_952_25, 2.389_244_6];
    /// Newton's method: y (3/2 − a y² / 2).
    const NEWTON: f32 = 1.5;
    let y = l.rsqrt_guess(a, MAGIC);
    let y = l.mul(
        l.mul(l.splat(FIRST[0]), y),
        l.sub_mul(l.mul(a, y), y, l.splat(FIRST[1])),
    );
    l.mul(
        y,
        l.sub_mul(l.mul(l.mul(l.splat(0.5), a), y), y, l.splat(NEWTON)),
    )
}
