//! Eight floats in one AVX2 register.

use super::ops::Simd8;
use super::slot::{LANES, Slot, Slots};
use crate::live::solver::explicit::vec4::{MAX_VERTICES, V4};
use bytemuck::cast;
use pulp::x86::V3;
use std::arch::x86_64::{__m128, __m256, __m256i};

/// Proof that the processor has AVX2 and fused products, with the lane orders of [`Simd8::broadcast_pairs`].
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Avx2 {
    v3: V3,
    orders: [[i32; LANES]; 2],
}

impl Avx2 {
    /// `None` where the processor lacks them.
    pub(in super::super) fn detect() -> Option<Self> {
        // Orders known to the compiler would become two instructions each instead of one.
        let orders = || std::hint::black_box([[0, 0, 0, 0, 1, 1, 1, 1], [2, 2, 2, 2, 3, 3, 3, 3]]);
        V3::try_new().map(|v3| Self {
            v3,
            orders: orders(),
        })
    }
}

/// Two vectors side by side.
#[inline(always)]
fn pair(v: V3, x: &[V4; MAX_VERTICES], low: Slot, high: Slot) -> __m256 {
    let low = v.avx._mm256_castps128_ps256(cast(low.get(x).0));
    v.avx._mm256_insertf128_ps::<1>(low, cast(high.get(x).0))
}

/// Components of eight vectors, given as 0|4, 1|5, 2|6, 3|7.
#[inline(always)]
fn columns(v: V3, r: [__m256; 4]) -> [__m256; 3] {
    let (a, b) = (
        v.avx._mm256_unpacklo_ps(r[0], r[1]),
        v.avx._mm256_unpacklo_ps(r[2], r[3]),
    );
    let (c, d) = (
        v.avx._mm256_unpackhi_ps(r[0], r[1]),
        v.avx._mm256_unpackhi_ps(r[2], r[3]),
    );
    [
        v.avx._mm256_shuffle_ps::<0x44>(a, b),
        v.avx._mm256_shuffle_ps::<0xEE>(a, b),
        v.avx._mm256_shuffle_ps::<0x44>(c, d),
    ]
}

/// Inverse of [`columns`].
#[inline(always)]
fn rows(v: V3, c: [__m256; 3]) -> [__m256; 4] {
    let zero = v.avx._mm256_setzero_ps();
    let (a, b) = (
        v.avx._mm256_unpacklo_ps(c[0], c[1]),
        v.avx._mm256_unpacklo_ps(c[2], zero),
    );
    let (d, e) = (
        v.avx._mm256_unpackhi_ps(c[0], c[1]),
        v.avx._mm256_unpackhi_ps(c[2], zero),
    );
    [
        v.avx._mm256_shuffle_ps::<0x44>(a, b),
        v.avx._mm256_shuffle_ps::<0xEE>(a, b),
        v.avx._mm256_shuffle_ps::<0x44>(d, e),
        v.avx._mm256_shuffle_ps::<0xEE>(d, e),
    ]
}

/// One lane of [`Simd8::scatter_add`].
#[inline(always)]
fn add(v: V3, out: &mut [V4; MAX_VERTICES], at: Slot, a: __m128) {
    let sum = v.sse._mm_add_ps(cast(at.get(out).0), a);
    at.set(out, V4(cast(sum)));
}

impl Simd8 for Avx2 {
    type F = __m256;
    #[inline(always)]
    fn load(self, a: &[f32; LANES]) -> __m256 {
        cast(*a)
    }
    #[inline(always)]
    fn splat(self, a: f32) -> __m256 {
        self.v3.avx._mm256_set1_ps(a)
    }
    #[inline(always)]
    fn add(self, a: __m256, b: __m256) -> __m256 {
        self.v3.avx._mm256_add_ps(a, b)
    }
    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        self.v3.avx._mm256_sub_ps(a, b)
    }
    #[inline(always)]
    fn mul(self, a: __m256, b: __m256) -> __m256 {
        self.v3.avx._mm256_mul_ps(a, b)
    }
    #[inline(always)]
    fn mul_add(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        self.v3.fma._mm256_fmadd_ps(a, b, c)
    }
    #[inline(always)]
    fn mul_sub(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        self.v3.fma._mm256_fmsub_ps(a, b, c)
    }
    #[inline(always)]
    fn sub_mul(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        self.v3.fma._mm256_fnmadd_ps(a, b, c)
    }
    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        self.v3.avx._mm256_max_ps(a, b)
    }
    #[inline(always)]
    fn rsqrt_guess(self, a: __m256, magic: u32) -> __m256 {
        let half = self.v3.avx2._mm256_srli_epi32::<1>(cast(a));
        let magic = self.v3.avx._mm256_set1_epi32(magic as i32);
        cast(self.v3.avx2._mm256_sub_epi32(magic, half))
    }
    #[inline(always)]
    fn edge_vectors(self, x: &[V4; MAX_VERTICES], a: &Slots, b: &Slots) -> [__m256; 3] {
        let v = self.v3;
        columns(
            v,
            [
                self.sub(pair(v, x, b[0], b[4]), pair(v, x, a[0], a[4])),
                self.sub(pair(v, x, b[1], b[5]), pair(v, x, a[1], a[5])),
                self.sub(pair(v, x, b[2], b[6]), pair(v, x, a[2], a[6])),
                self.sub(pair(v, x, b[3], b[7]), pair(v, x, a[3], a[7])),
            ],
        )
    }
    #[inline(always)]
    fn scatter_add(self, out: &mut [V4; MAX_VERTICES], at: &Slots, a: [__m256; 3]) {
        let v = self.v3;
        let r = rows(v, a);
        add(v, out, at[0], v.avx._mm256_castps256_ps128(r[0]));
        add(v, out, at[1], v.avx._mm256_castps256_ps128(r[1]));
        add(v, out, at[2], v.avx._mm256_castps256_ps128(r[2]));
        add(v, out, at[3], v.avx._mm256_castps256_ps128(r[3]));
        add(v, out, at[4], v.avx._mm256_extractf128_ps::<1>(r[0]));
        add(v, out, at[5], v.avx._mm256_extractf128_ps::<1>(r[1]));
        add(v, out, at[6], v.avx._mm256_extractf128_ps::<1>(r[2]));
        add(v, out, at[7], v.avx._mm256_extractf128_ps::<1>(r[3]));
    }
    #[inline(always)]
    fn gather_pair(self, x: &[V4; MAX_VERTICES], at: [Slot; 2]) -> __m256 {
        pair(self.v3, x, at[0], at[1])
    }
    #[inline(always)]
    fn load_pair(self, x: &[V4; 2]) -> __m256 {
        cast([x[0].0, x[1].0])
    }
    #[inline(always)]
    fn store_pair(self, x: __m256, to: &mut [V4; 2]) {
        let [low, high]: [[f32; 4]; 2] = cast(x);
        *to = [V4(low), V4(high)];
    }
    #[inline(always)]
    fn broadcast_pairs(self, a: &[[f32; 2]; 2]) -> [__m256; 2] {
        let v = self.v3;
        let four = v.avx._mm256_castps128_ps256(cast(*a));
        let [first, second]: [__m256i; 2] = cast(self.orders);
        [
            v.avx2._mm256_permutevar8x32_ps(four, first),
            v.avx2._mm256_permutevar8x32_ps(four, second),
        ]
    }
}
