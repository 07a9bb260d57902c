//! Eight floats at once, in one AVX2 register where the processor has them, else as the compiler splits them.
//!
//! A product and a sum are fused (rounded once) in [`Simd8::mul_add`] and its kin only, so both give the same bits.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod ops;
mod scalar;
mod slot;

#[cfg(target_arch = "x86_64")]
pub(super) use avx2::Avx2;
pub(super) use ops::{Simd8, add3, dot, mul_add3, rsqrt, scale3, sub3};
pub(super) use scalar::Scalar;
pub(super) use slot::{LANES, Slot, Slots};
