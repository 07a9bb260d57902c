//! Eight floats as the compiler splits them: any processor, and the oracle of the wide registers.

use super::ops::Simd8;
use super::slot::{LANES, Slot, Slots};
use crate::live::solver::explicit::vec4::{MAX_VERTICES, V4};

/// Any processor.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Scalar;

impl Simd8 for Scalar {
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
        // As the AVX2 instruction: the second operand where one is not a number.
        std::array::from_fn(|k| if a[k] > b[k] { a[k] } else { b[k] })
    }
    #[inline(always)]
    fn rsqrt_guess(self, a: Self::F, magic: u32) -> Self::F {
        a.map(|a| f32::from_bits(magic.wrapping_sub(a.to_bits() >> 1)))
    }
    #[inline(always)]
    fn edge_vectors(self, x: &[V4; MAX_VERTICES], a: &Slots, b: &Slots) -> [Self::F; 3] {
        let d: [V4; LANES] = std::array::from_fn(|k| b[k].get(x) - a[k].get(x));
        std::array::from_fn(|c| d.map(|d| d.0[c]))
    }
    #[inline(always)]
    fn scatter_add(self, out: &mut [V4; MAX_VERTICES], at: &Slots, a: [Self::F; 3]) {
        for (k, at) in at.iter().enumerate() {
            at.set(out, at.get(out) + V4::new(a[0][k], a[1][k], a[2][k]));
        }
    }
    #[inline(always)]
    fn gather_pair(self, x: &[V4; MAX_VERTICES], at: [Slot; 2]) -> Self::F {
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
    fn broadcast_pairs(self, a: &[[f32; 2]; 2]) -> [Self::F; 2] {
        a.map(|a| std::array::from_fn(|k| a[k / 4]))
    }
}
