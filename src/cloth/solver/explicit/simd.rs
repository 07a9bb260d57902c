//! Eight numbers at once: what the kernels compute with. With AVX2 a register holds them, else the compiler cuts them
//! up. A product and a sum are fused (rounded once) where [`Lanes::mul_add`] says so and nowhere else, so both give the
//! same bits.

use super::patch_model::MOST;
use super::patch_state::V4;

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
        unsafe {
            *x.as_ptr()
                .cast::<u8>()
                .add(8 * usize::from(self.0))
                .cast::<V4>()
        }
    }
    /// Replaces its vector.
    #[allow(unsafe_code)]
    #[inline(always)]
    pub(super) fn set(self, x: &mut [V4; MOST], to: V4) {
        unsafe {
            *x.as_mut_ptr()
                .cast::<u8>()
                .add(8 * usize::from(self.0))
                .cast::<V4>() = to
        }
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
    /// a b + c, rounded once.
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// a b − c, rounded once.
    fn mul_sub(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// c − a b, rounded once.
    fn sub_mul(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// `magic` minus half of the bits of positive numbers: the start of a reciprocal square root.
    fn guess(self, a: Self::F, magic: u32) -> Self::F;
    /// Components of x[b] − x[a].
    fn between(self, x: &[V4; MOST], a: &At, b: &At) -> [Self::F; 3];
    /// Adds vectors to what is at eight places, lane by lane.
    fn put(self, out: &mut [V4; MOST], at: &At, a: [Self::F; 3]);
    /// Two vectors side by side.
    fn pair(self, x: &[V4; MOST], at: [Place; 2]) -> Self::F;
    /// Two vectors that follow each other.
    fn load_pair(self, x: &[V4; 2]) -> Self::F;
    /// The other way round.
    fn store_pair(self, x: Self::F, to: &mut [V4; 2]);
    /// A number for each of two vectors, twice.
    fn each(self, a: &[[f32; 2]; 2]) -> [Self::F; 2];
}

/// The inner product of three components.
#[inline(always)]
pub(super) fn dot<L: Lanes>(l: L, a: [L::F; 3], b: [L::F; 3]) -> L::F {
    l.mul_add(a[2], b[2], l.mul_add(a[1], b[1], l.mul(a[0], b[0])))
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

/// Vectors times numbers, added to others.
#[inline(always)]
pub(super) fn mul_add3<L: Lanes>(l: L, a: [L::F; 3], s: L::F, b: [L::F; 3]) -> [L::F; 3] {
    [
        l.mul_add(a[0], s, b[0]),
        l.mul_add(a[1], s, b[1]),
        l.mul_add(a[2], s, b[2]),
    ]
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
    let y = l.mul(
        l.mul(l.splat(FIRST[0]), y),
        l.sub_mul(l.mul(a, y), y, l.splat(FIRST[1])),
    );
    l.mul(
        y,
        l.sub_mul(l.mul(l.mul(l.splat(0.5), a), y), y, l.splat(1.5)),
    )
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
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        std::array::from_fn(|k| a[k].mul_add(b[k], c[k]))
    }
    #[inline(always)]
    fn mul_sub(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        std::array::from_fn(|k| a[k].mul_add(b[k], -c[k]))
    }
    #[inline(always)]
    fn sub_mul(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        std::array::from_fn(|k| (-a[k]).mul_add(b[k], c[k]))
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
    fn put(self, out: &mut [V4; MOST], at: &At, a: [Self::F; 3]) {
        for (k, at) in at.iter().enumerate() {
            at.set(out, at.get(out) + V4::new(a[0][k], a[1][k], a[2][k]));
        }
    }
    #[inline(always)]
    fn pair(self, x: &[V4; MOST], at: [Place; 2]) -> Self::F {
        self.load_pair(&at.map(|at| at.get(x)))
    }
    #[inline(always)]
    fn load_pair(self, x: &[V4; 2]) -> Self::F {
        std::array::from_fn(|k| x[k / 4].0[k % 4])
    }
    #[inline(always)]
    fn store_pair(self, x: Self::F, to: &mut [V4; 2]) {
        *to = std::array::from_fn(|v| V4(std::array::from_fn(|k| x[4 * v + k])));
    }
    #[inline(always)]
    fn each(self, a: &[[f32; 2]; 2]) -> [Self::F; 2] {
        a.map(|a| std::array::from_fn(|k| a[k / 4]))
    }
}

/// A processor with AVX2 and fused products: only made where there is one.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2([[i32; LANES]; 2]);

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
        let can = std::arch::is_x86_feature_detected!("avx2")
            && std::arch::is_x86_feature_detected!("fma");
        // Were these orders known to the compiler, it would take two instructions for each and not one.
        can.then(|| {
            Avx2(std::hint::black_box([
                [0, 0, 0, 0, 1, 1, 1, 1],
                [2, 2, 2, 2, 3, 3, 3, 3],
            ]))
        })
    }

    /// Two vectors side by side.
    #[inline(always)]
    unsafe fn pair(x: &[V4; MOST], low: Place, high: Place) -> __m256 {
        unsafe {
            _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(vector(x, low)), vector(x, high))
        }
    }

    #[inline(always)]
    unsafe fn vector(x: &[V4; MOST], at: Place) -> __m128 {
        unsafe { _mm_load_ps(x.as_ptr().cast::<u8>().add(8 * usize::from(at.0)).cast()) }
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

    /// The other way round.
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

    /// One lane of [`Lanes::put`].
    #[inline(always)]
    unsafe fn add(out: *mut u8, at: Place, a: __m128) {
        unsafe {
            let to = out.add(8 * usize::from(at.0)).cast();
            _mm_store_ps(to, _mm_add_ps(_mm_load_ps(to), a));
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
        fn put(self, out: &mut [V4; MOST], at: &At, a: [__m256; 3]) {
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
        fn pair(self, x: &[V4; MOST], at: [Place; 2]) -> __m256 {
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
        fn each(self, a: &[[f32; 2]; 2]) -> [__m256; 2] {
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
}
