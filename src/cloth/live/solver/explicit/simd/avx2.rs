//! Eight floats in one AVX2 register.
// Sound: a value of `Avx2` exists only after the processor was queried, and pointers come from references to arrays and
// slots within them.
#![allow(unsafe_code)]

use super::ops::Simd8;
use super::slot::{LANES, Slot, Slots};
use crate::live::solver::explicit::vec4::{MAX_VERTICES, V4};
use std::arch::x86_64::*;

/// Proof that the processor has AVX2 and fused products, with the lane orders of [`Simd8::broadcast_pairs`].
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Avx2([[i32; LANES]; 2]);

impl Avx2 {
    /// `None` where the processor lacks them.
    pub(in super::super) fn detect() -> Option<Self> {
        let can = std::arch::is_x86_feature_detected!("avx2")
            && std::arch::is_x86_feature_detected!("fma");
        // Orders known to the compiler would become two instructions each instead of one.
        can.then(|| {
            Self(std::hint::black_box([
                [0, 0, 0, 0, 1, 1, 1, 1],
                [2, 2, 2, 2, 3, 3, 3, 3],
            ]))
        })
    }
}

/// Two vectors side by side.
#[inline(always)]
unsafe fn pair(x: &[V4; MAX_VERTICES], low: Slot, high: Slot) -> __m256 {
    unsafe { _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(vector(x, low)), vector(x, high)) }
}

#[inline(always)]
unsafe fn vector(x: &[V4; MAX_VERTICES], at: Slot) -> __m128 {
    unsafe { _mm_load_ps(x.as_ptr().cast::<u8>().add(at.byte_offset()).cast()) }
}

/// Components of eight vectors, given as 0|4, 1|5, 2|6, 3|7.
#[inline(always)]
unsafe fn columns(r: [__m256; 4]) -> [__m256; 3] {
    unsafe {
        let (a, b) = (
            _mm256_unpacklo_ps(r[0], r[1]),
            _mm256_unpacklo_ps(r[2], r[3]),
        );
        let (c, d) = (
            _mm256_unpackhi_ps(r[0], r[1]),
            _mm256_unpackhi_ps(r[2], r[3]),
        );
        [
            _mm256_shuffle_ps::<0x44>(a, b),
            _mm256_shuffle_ps::<0xEE>(a, b),
            _mm256_shuffle_ps::<0x44>(c, d),
        ]
    }
}

/// Inverse of [`columns`].
#[inline(always)]
unsafe fn rows(c: [__m256; 3]) -> [__m256; 4] {
    unsafe {
        let zero = _mm256_setzero_ps();
        let (a, b) = (
            _mm256_unpacklo_ps(c[0], c[1]),
            _mm256_unpacklo_ps(c[2], zero),
        );
        let (d, e) = (
            _mm256_unpackhi_ps(c[0], c[1]),
            _mm256_unpackhi_ps(c[2], zero),
        );
        [
            _mm256_shuffle_ps::<0x44>(a, b),
            _mm256_shuffle_ps::<0xEE>(a, b),
            _mm256_shuffle_ps::<0x44>(d, e),
            _mm256_shuffle_ps::<0xEE>(d, e),
        ]
    }
}

/// One lane of [`Simd8::scatter_add`].
#[inline(always)]
unsafe fn add(out: *mut u8, at: Slot, a: __m128) {
    unsafe {
        let to = out.add(at.byte_offset()).cast();
        _mm_store_ps(to, _mm_add_ps(_mm_load_ps(to), a));
    }
}

impl Simd8 for Avx2 {
    type F = __m256;
    #[inline(always)]
    fn load(self, a: &[f32; LANES]) -> __m256 {
        unsafe { _mm256_loadu_ps(a.as_ptr()) }
    }
    #[inline(always)]
    fn splat(self, a: f32) -> __m256 {
        unsafe { _mm256_set1_ps(a) }
    }
    #[inline(always)]
    fn add(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_add_ps(a, b) }
    }
    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_sub_ps(a, b) }
    }
    #[inline(always)]
    fn mul(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_mul_ps(a, b) }
    }
    #[inline(always)]
    fn mul_add(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        unsafe { _mm256_fmadd_ps(a, b, c) }
    }
    #[inline(always)]
    fn mul_sub(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        unsafe { _mm256_fmsub_ps(a, b, c) }
    }
    #[inline(always)]
    fn sub_mul(self, a: __m256, b: __m256, c: __m256) -> __m256 {
        unsafe { _mm256_fnmadd_ps(a, b, c) }
    }
    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_max_ps(a, b) }
    }
    #[inline(always)]
    fn rsqrt_guess(self, a: __m256, magic: u32) -> __m256 {
        unsafe {
            let half = _mm256_srli_epi32::<1>(_mm256_castps_si256(a));
            _mm256_castsi256_ps(_mm256_sub_epi32(_mm256_set1_epi32(magic as i32), half))
        }
    }
    #[inline(always)]
    fn edge_vectors(self, x: &[V4; MAX_VERTICES], a: &Slots, b: &Slots) -> [__m256; 3] {
        unsafe {
            columns([
                _mm256_sub_ps(pair(x, b[0], b[4]), pair(x, a[0], a[4])),
                _mm256_sub_ps(pair(x, b[1], b[5]), pair(x, a[1], a[5])),
                _mm256_sub_ps(pair(x, b[2], b[6]), pair(x, a[2], a[6])),
                _mm256_sub_ps(pair(x, b[3], b[7]), pair(x, a[3], a[7])),
            ])
        }
    }
    #[inline(always)]
    fn scatter_add(self, out: &mut [V4; MAX_VERTICES], at: &Slots, a: [__m256; 3]) {
        unsafe {
            let (r, out) = (rows(a), out.as_mut_ptr().cast::<u8>());
            add(out, at[0], _mm256_castps256_ps128(r[0]));
            add(out, at[1], _mm256_castps256_ps128(r[1]));
            add(out, at[2], _mm256_castps256_ps128(r[2]));
            add(out, at[3], _mm256_castps256_ps128(r[3]));
            add(out, at[4], _mm256_extractf128_ps::<1>(r[0]));
            add(out, at[5], _mm256_extractf128_ps::<1>(r[1]));
            add(out, at[6], _mm256_extractf128_ps::<1>(r[2]));
            add(out, at[7], _mm256_extractf128_ps::<1>(r[3]));
        }
    }
    #[inline(always)]
    fn gather_pair(self, x: &[V4; MAX_VERTICES], at: [Slot; 2]) -> __m256 {
        unsafe { pair(x, at[0], at[1]) }
    }
    #[inline(always)]
    fn load_pair(self, x: &[V4; 2]) -> __m256 {
        unsafe { _mm256_loadu_ps(x.as_ptr().cast()) }
    }
    #[inline(always)]
    fn store_pair(self, x: __m256, to: &mut [V4; 2]) {
        unsafe { _mm256_storeu_ps(to.as_mut_ptr().cast(), x) }
    }
    #[inline(always)]
    fn broadcast_pairs(self, a: &[[f32; 2]; 2]) -> [__m256; 2] {
        unsafe {
            let four = _mm256_castps128_ps256(_mm_loadu_ps(a.as_ptr().cast()));
            let of = |order: &[i32; LANES]| _mm256_loadu_si256(order.as_ptr().cast());
            [
                _mm256_permutevar8x32_ps(four, of(&self.0[0])),
                _mm256_permutevar8x32_ps(four, of(&self.0[1])),
            ]
        }
    }
}
