//! Eight numbers at once: what the kernels compute with. With AVX2 a register holds them, else the compiler cuts them
//! up; both round after each operation, none is fused, so both give the same bits.

use super::fabric::MOST;
use super::motion::V4;

/// Numbers that are taken together.
pub(super) const LANES: usize = 8;
/// Places of eight vertices.
pub(super) type At = [Place; LANES];

/// Where a vertex is in a table of [`MOST`] vectors: twice its number, which the processor multiplies by eight for
/// nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place(u16);

impl Place {
    /// Of vertex `i`, below [`MOST`].
    pub(super) fn of(i: usize) -> Self {
        assert!(i < MOST, "patches are cut so that vertex {i} fits");
        Self(2 * i as u16)
    }
    /// The vertex.
    #[inline(always)]
    pub(super) fn index(self) -> usize {
        usize::from(self.0 / 2)
    }
    /// Its vector.
    // Sound: half of the number, below MOST by construction, is an index.
    #[allow(unsafe_code)]
    #[inline(always)]
    pub(super) fn get(self, x: &[V4; MOST]) -> V4 {
        unsafe { *x.as_ptr().cast::<u8>().add(8 * usize::from(self.0)).cast::<V4>() }
    }
    /// Replaces its vector.
    #[allow(unsafe_code)]
    #[inline(always)]
    pub(super) fn set(self, x: &mut [V4; MOST], to: V4) {
        unsafe { *x.as_mut_ptr().cast::<u8>().add(8 * usize::from(self.0)).cast::<V4>() = to }
    }
}

/// Operations on eight numbers.
pub(super) trait Lanes: Copy {
    /// Eight numbers.
    type F: Copy;
    fn load(self, a: &[f32; LANES]) -> Self::F;
    fn splat(self, a: f32) -> Self::F;
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// `magic` minus half of the bits of positive numbers: the start of a reciprocal square root.
    fn guess(self, a: Self::F, magic: u32) -> Self::F;
    /// Components of x[b] − x[a].
    fn between(self, x: &[V4; MOST], a: &At, b: &At) -> [Self::F; 3];
    /// Adds `a` to each first corner, takes `b` from each second and adds b − a to each third, lane by lane.
    fn push(self, out: &mut [V4; MOST], v: &[At; 3], a: [Self::F; 3], b: [Self::F; 3]);
}

/// The inner product of three components.
#[inline(always)]
pub(super) fn dot<L: Lanes>(l: L, a: [L::F; 3], b: [L::F; 3]) -> L::F {
    l.add(l.add(l.mul(a[0], b[0]), l.mul(a[1], b[1])), l.mul(a[2], b[2]))
}

// No closures here and where lanes are used: they would be compiled for themselves, without the wide registers.

/// Component by component.
#[inline(always)]
pub(super) fn add3<L: Lanes>(l: L, a: [L::F; 3], b: [L::F; 3]) -> [L::F; 3] {
    [l.add(a[0], b[0]), l.add(a[1], b[1]), l.add(a[2], b[2])]
}

/// Component by component.
#[inline(always)]
pub(super) fn sub3<L: Lanes>(l: L, a: [L::F; 3], b: [L::F; 3]) -> [L::F; 3] {
    [l.sub(a[0], b[0]), l.sub(a[1], b[1]), l.sub(a[2], b[2])]
}

/// Vectors times numbers.
#[inline(always)]
pub(super) fn scale3<L: Lanes>(l: L, a: [L::F; 3], s: L::F) -> [L::F; 3] {
    [l.mul(a[0], s), l.mul(a[1], s), l.mul(a[2], s)]
}

/// 1 / √a of positive numbers to 7e-7: two rounds of Newton's method, the first with the constants of Moroz et al. 2018
/// (after Kadlec). A square root and a division of the processor are exact and take three times as long.
#[inline(always)]
pub(super) fn inverse_root<L: Lanes>(l: L, a: L::F) -> L::F {
    const MAGIC: u32 = 0x5F1F_FFF9;
    const FIRST: [f32; 2] = [0.703_952_25, 2.389_244_6];
    let y = l.guess(a, MAGIC);
    let y = l.mul(l.mul(l.splat(FIRST[0]), y), l.sub(l.splat(FIRST[1]), l.mul(l.mul(a, y), y)));
    l.mul(y, l.sub(l.splat(1.5), l.mul(l.mul(l.mul(l.splat(0.5), a), y), y)))
}

/// Any processor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plain;

impl Lanes for Plain {
    type F = [f32; LANES];
    #[inline(always)]
    fn load(self, a: &[f32; LANES]) -> Self::F {
        *a
    }
    #[inline(always)]
    fn splat(self, a: f32) -> Self::F {
        [a; LANES]
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        std::array::from_fn(|k| a[k] + b[k])
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        std::array::from_fn(|k| a[k] - b[k])
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        std::array::from_fn(|k| a[k] * b[k])
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        // As the instruction: the second where they don't compare.
        std::array::from_fn(|k| if a[k] > b[k] { a[k] } else { b[k] })
    }
    #[inline(always)]
    fn guess(self, a: Self::F, magic: u32) -> Self::F {
        a.map(|a| f32::from_bits(magic.wrapping_sub(a.to_bits() >> 1)))
    }
    #[inline(always)]
    fn between(self, x: &[V4; MOST], a: &At, b: &At) -> [Self::F; 3] {
        let d: [V4; LANES] = std::array::from_fn(|k| b[k].get(x) - a[k].get(x));
        std::array::from_fn(|c| d.map(|d| d.0[c]))
    }
    #[inline(always)]
    fn push(self, out: &mut [V4; MOST], v: &[At; 3], a: [Self::F; 3], b: [Self::F; 3]) {
        for k in 0..LANES {
            let [a, b] = [a, b].map(|f| V4::new(f[0][k], f[1][k], f[2][k]));
            let [i, j, l] = v.map(|v| v[k]);
            i.set(out, i.get(out) + a);
            j.set(out, j.get(out) - b);
            l.set(out, l.get(out) + (b - a));
        }
    }
}

/// A processor with AVX2: only made where there is one.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2(());

#[cfg(target_arch = "x86_64")]
pub(super) use avx2::detect;

// Sound: a value of `Avx2` says that the processor has been asked, and pointers come from references to tables and places
// in them.
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2 {
    use super::{At, Avx2, LANES, Lanes, MOST, Place, V4};
    use std::arch::x86_64::*;

    pub(in super::super) fn detect() -> Option<Avx2> {
        std::arch::is_x86_feature_detected!("avx2").then_some(Avx2(()))
    }

    /// Two vectors side by side.
    #[inline(always)]
    unsafe fn pair(x: &[V4; MOST], low: Place, high: Place) -> __m256 {
        unsafe { _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(vector(x, low)), vector(x, high)) }
    }

    #[inline(always)]
    unsafe fn vector(x: &[V4; MOST], at: Place) -> __m128 {
        unsafe { _mm_load_ps(x.as_ptr().cast::<u8>().add(8 * usize::from(at.0)).cast()) }
    }

    /// Components of eight vectors, given as 0|4, 1|5, 2|6, 3|7.
    #[inline(always)]
    unsafe fn columns(r: [__m256; 4]) -> [__m256; 3] {
        unsafe {
            let (a, b) = (_mm256_unpacklo_ps(r[0], r[1]), _mm256_unpacklo_ps(r[2], r[3]));
            let (c, d) = (_mm256_unpackhi_ps(r[0], r[1]), _mm256_unpackhi_ps(r[2], r[3]));
            [_mm256_shuffle_ps::<0x44>(a, b), _mm256_shuffle_ps::<0xEE>(a, b), _mm256_shuffle_ps::<0x44>(c, d)]
        }
    }

    /// The other way round.
    #[inline(always)]
    unsafe fn rows(c: [__m256; 3]) -> [__m256; 4] {
        unsafe {
            let zero = _mm256_setzero_ps();
            let (a, b) = (_mm256_unpacklo_ps(c[0], c[1]), _mm256_unpacklo_ps(c[2], zero));
            let (d, e) = (_mm256_unpackhi_ps(c[0], c[1]), _mm256_unpackhi_ps(c[2], zero));
            [
                _mm256_shuffle_ps::<0x44>(a, b),
                _mm256_shuffle_ps::<0xEE>(a, b),
                _mm256_shuffle_ps::<0x44>(d, e),
                _mm256_shuffle_ps::<0xEE>(d, e),
            ]
        }
    }

    /// One triangle of [`Lanes::push`].
    #[inline(always)]
    unsafe fn corners(out: &mut [V4; MOST], v: &[At; 3], k: usize, a: __m128, b: __m128, c: __m128) {
        unsafe {
            let out = out.as_mut_ptr().cast::<u8>();
            let (i, j, l): (*mut f32, *mut f32, *mut f32) = (
                out.add(8 * usize::from(v[0][k].0)).cast(),
                out.add(8 * usize::from(v[1][k].0)).cast(),
                out.add(8 * usize::from(v[2][k].0)).cast(),
            );
            _mm_store_ps(i, _mm_add_ps(_mm_load_ps(i), a));
            _mm_store_ps(j, _mm_sub_ps(_mm_load_ps(j), b));
            _mm_store_ps(l, _mm_add_ps(_mm_load_ps(l), c));
        }
    }

    #[inline(always)]
    unsafe fn low(out: &mut [V4; MOST], v: &[At; 3], k: usize, a: __m256, b: __m256, c: __m256) {
        unsafe {
            corners(out, v, k, _mm256_castps256_ps128(a), _mm256_castps256_ps128(b), _mm256_castps256_ps128(c));
        }
    }

    #[inline(always)]
    unsafe fn high(out: &mut [V4; MOST], v: &[At; 3], k: usize, a: __m256, b: __m256, c: __m256) {
        unsafe {
            let (a, b) = (_mm256_extractf128_ps::<1>(a), _mm256_extractf128_ps::<1>(b));
            corners(out, v, k, a, b, _mm256_extractf128_ps::<1>(c));
        }
    }

    impl Lanes for Avx2 {
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
        fn max(self, a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_max_ps(a, b) }
        }
        #[inline(always)]
        fn guess(self, a: __m256, magic: u32) -> __m256 {
            unsafe {
                let half = _mm256_srli_epi32::<1>(_mm256_castps_si256(a));
                _mm256_castsi256_ps(_mm256_sub_epi32(_mm256_set1_epi32(magic as i32), half))
            }
        }
        #[inline(always)]
        fn between(self, x: &[V4; MOST], a: &At, b: &At) -> [__m256; 3] {
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
        fn push(self, out: &mut [V4; MOST], v: &[At; 3], a: [__m256; 3], b: [__m256; 3]) {
            unsafe {
                let (a, b) = (rows(a), rows(b));
                let c = [
                    _mm256_sub_ps(b[0], a[0]),
                    _mm256_sub_ps(b[1], a[1]),
                    _mm256_sub_ps(b[2], a[2]),
                    _mm256_sub_ps(b[3], a[3]),
                ];
                low(out, v, 0, a[0], b[0], c[0]);
                low(out, v, 1, a[1], b[1], c[1]);
                low(out, v, 2, a[2], b[2], c[2]);
                low(out, v, 3, a[3], b[3], c[3]);
                high(out, v, 4, a[0], b[0], c[0]);
                high(out, v, 5, a[1], b[1], c[1]);
                high(out, v, 6, a[2], b[2], c[2]);
                high(out, v, 7, a[3], b[3], c[3]);
            }
        }
    }
}
