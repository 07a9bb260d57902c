//! Numbers that certificates are computed in: f64, and a pair of f64 for what f64 cannot decide.

use std::ops::{Add, Div, Mul, Neg, Sub};
use tryon_geometry::math::V3d;

/// Unit roundoff of f64, 2⁻⁵³.
pub(super) const UNIT: f64 = f64::EPSILON / 2.0;

/// Least threshold: absorbs underflow, and makes a zero direction separate nothing.
pub(super) const UNDERFLOW: f64 = 1e-290;

/// A floating-point arithmetic.
pub(super) trait Arithmetic:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Bound of the relative error of one operation. The difference of two f64 also has it.
    const UNIT: f64;
    /// The number itself.
    fn of(value: f64) -> Self;
    /// Nearest f64.
    fn to_f64(self) -> f64;
}

impl Arithmetic for f64 {
    const UNIT: f64 = UNIT;
    #[inline]
    fn of(value: f64) -> Self {
        value
    }
    #[inline]
    fn to_f64(self) -> f64 {
        self
    }
}

/// Unevaluated sum of two f64 (Dekker 1971), the second at most half a unit in the last place of the first.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct DoubleDouble {
    high: f64,
    low: f64,
}

impl DoubleDouble {
    /// Sum of numbers of which the first is the larger.
    fn renormalised(high: f64, low: f64) -> Self {
        let sum = high + low;
        Self {
            high: sum,
            low: low - (sum - high),
        }
    }

    /// Exact sum (Knuth).
    fn exact_sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let part = high - a;
        Self {
            high,
            low: (a - (high - part)) + (b - part),
        }
    }

    /// Exact product (Dekker), without the fused multiplication that the baseline x86-64 target lacks.
    fn exact_product(a: f64, b: f64) -> Self {
        let halves = |x: f64| {
            let shifted = 134_217_729.0 * x; // 2²⁷ + 1
            let high = shifted - (shifted - x);
            (high, x - high)
        };
        let ((a1, a2), (b1, b2)) = (halves(a), halves(b));
        let high = a * b;
        Self {
            high,
            low: ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2,
        }
    }
}

impl Arithmetic for DoubleDouble {
    /// 32 u²: twice the bound of the division, the least accurate operation (Joldes et al. 2017).
    const UNIT: f64 = 32.0 * UNIT * UNIT;
    fn of(value: f64) -> Self {
        Self {
            high: value,
            low: 0.0,
        }
    }
    fn to_f64(self) -> f64 {
        self.high
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (high, low) = (
            Self::exact_sum(self.high, other.high),
            Self::exact_sum(self.low, other.low),
        );
        let sum = Self::renormalised(high.high, high.low + low.high);
        Self::renormalised(sum.high, low.low + sum.low)
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            high: -self.high,
            low: -self.low,
        }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = Self::exact_product(self.high, other.high);
        let cross = self.high * other.low + self.low * other.high;
        Self::renormalised(product.high, product.low + cross)
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other * Self::of(first);
        let second = rest.high / other.high;
        let rest = rest - other * Self::of(second);
        let sum = Self::renormalised(first, second);
        sum + Self::of(rest.high / other.high)
    }
}

/// A vector in some arithmetic.
pub(super) type Vector<S> = [S; 3];

#[inline]
pub(super) fn map2<S: Copy>(a: &Vector<S>, b: &Vector<S>, f: impl Fn(S, S) -> S) -> Vector<S> {
    [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])]
}

#[inline]
pub(super) fn dot<S: Arithmetic>(a: &Vector<S>, b: &Vector<S>) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(super) fn cross<S: Arithmetic>(a: &Vector<S>, b: &Vector<S>) -> Vector<S> {
    let minor = |i: usize, j: usize| a[i] * b[j] - a[j] * b[i];
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

#[inline]
pub(super) fn difference<S: Arithmetic>(a: &Vector<S>, b: &Vector<S>) -> Vector<S> {
    map2(a, b, |x, y| x - y)
}

#[inline]
pub(super) fn scaled<S: Arithmetic>(a: &Vector<S>, s: S) -> Vector<S> {
    a.map(|x| x * s)
}

/// `(1 - t) a + t b`.
#[inline]
pub(super) fn mix<S: Arithmetic>(a: S, b: S, t: S) -> S {
    a * (S::of(1.0) - t) + b * t
}

/// Magnitudes of the components, in f64.
#[inline]
pub(super) fn magnitudes<S: Arithmetic>(a: &Vector<S>) -> V3d {
    V3d::new(
        a[0].to_f64().abs(),
        a[1].to_f64().abs(),
        a[2].to_f64().abs(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn double_double_keeps_what_f64_loses() {
        let d = DoubleDouble::of;
        let tiny = 2f64.powi(-70);
        let sum = d(1.0) + d(tiny);
        assert_eq!((sum - d(1.0)).to_f64(), tiny);
        let third = d(1.0) / d(3.0);
        let rest = (third * d(3.0) - d(1.0)).to_f64();
        assert!(rest.abs() <= DoubleDouble::UNIT, "{rest:e}");
        // (1 + ε)² − 1 − 2 ε = ε²
        let e = 2f64.powi(-40);
        let square = (d(1.0) + d(e)) * (d(1.0) + d(e)) - d(1.0) - d(2.0 * e);
        assert_eq!(square.to_f64(), e * e);
        assert!(d(1.0) < sum && -sum < d(-1.0));
    }
}
