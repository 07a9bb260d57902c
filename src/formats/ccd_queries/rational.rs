//! Ratio of two decimal integers of any length, correctly rounded to f64.

use num_bigint::BigInt;
use num_rational::Ratio;
use num_traits::{ToPrimitive, Zero};

/// Decimal digits of one integer. More than the exact quotients of any two f64 need.
const MAX_DIGITS: usize = 2048;

/// Nearest f64 of a rational number, ties to even.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rounded {
    pub(super) value: f64,
    /// True if the number is the f64.
    pub(super) is_exact: bool,
}

/// Rounds `numerator / denominator`.
///
/// # Errors
/// The fault, when one isn't an integer, the denominator isn't positive, or the quotient is beyond the range of f64.
pub(super) fn round_ratio(numerator: &str, denominator: &str) -> Result<Rounded, String> {
    let digits = numerator.strip_prefix('-');
    let mut n = magnitude(digits.unwrap_or(numerator))?;
    if digits.is_some() {
        n = -n;
    }
    let d = magnitude(denominator)?;
    if d.is_zero() {
        return Err("the denominator is 0".to_owned());
    }

    if let (Some(n), Some(d)) = (exact_f64(&n), exact_f64(&d)) {
        let value = n / d;
        let is_exact = value.mul_add(d, -n) == 0.0;
        return Ok(Rounded { value, is_exact });
    }
    // Reduced or not, the value is the same.
    let ratio = Ratio::new_raw(n, d);
    let beyond = || "the quotient is beyond the range of f64".to_owned();
    let value = ratio.to_f64().filter(|v| v.is_normal() || ratio.is_zero());
    let value = value.ok_or_else(beyond)?;
    let rounded = Ratio::<BigInt>::from_float(value).ok_or_else(beyond)?;
    Ok(Rounded {
        value,
        is_exact: rounded.numer() * ratio.denom() == ratio.numer() * rounded.denom(),
    })
}

/// The value if f64 holds it exactly; most do, and one division rounds their ratio six times as fast.
fn exact_f64(integer: &BigInt) -> Option<f64> {
    let integer = integer.to_i128().filter(|i| i.unsigned_abs() < 1 << 96)?;
    Some(integer as f64).filter(|v| *v as i128 == integer)
}

fn magnitude(digits: &str) -> Result<BigInt, String> {
    let is_number = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
    let short = Some(digits).filter(|d| is_number && d.len() <= MAX_DIGITS);
    short.and_then(|d| d.parse().ok()).ok_or_else(|| {
        let shown: String = digits.chars().take(24).collect();
        format!(
            "`{shown}` is not an integer (the denominator unsigned) of at most {MAX_DIGITS} digits"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(n: &str, d: &str) -> (f64, bool) {
        let r = round_ratio(n, d).expect("a rational");
        (r.value, r.is_exact)
    }

    #[test]
    fn short_ratios_are_those_of_f64() {
        assert_eq!(value("-3", "4"), (-0.75, true));
        assert_eq!(value("0", "7"), (0.0, true));
        assert_eq!(value("1", "3"), (1.0 / 3.0, false));
        assert_eq!(
            value("6004799503160661", "36028797018963968"),
            (6004799503160661.0 / 36028797018963968.0, true)
        );
    }

    #[test]
    fn long_ratios_are_correctly_rounded() {
        // 2^200 + 1 over 2^200: just over 1.
        let (n, d) = (
            "1606938044258990275541962092341162602522202993782792835301377",
            "1606938044258990275541962092341162602522202993782792835301376",
        );
        assert_eq!(value(n, d), (1.0, false));
        assert_eq!(value(d, d), (1.0, true));
        assert_eq!(value("-1", d), (-(2f64.powi(-200)), true));
        assert_eq!(value(d, "1"), (2f64.powi(200), true));
        // Halfway between 2^53 and its successor: ties to even; one more than halfway is rounded up.
        assert_eq!(value("9007199254740993", "1"), (9007199254740992.0, false));
        assert_eq!(
            value("90071992547409930000000000001", "10000000000000"),
            (9007199254740994.0, false)
        );
        assert_eq!(
            value("90071992547409930000000000000", "10000000000000"),
            (9007199254740992.0, false)
        );
    }

    #[test]
    fn random_ratios_of_long_integers_agree_with_f64() {
        use rand::{Rng, SeedableRng};
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(1);
        for _ in 0..500 {
            let (n, d) = (random.random::<u128>() >> 60, random.random::<u64>() >> 11);
            let long = |v: u128| (BigInt::from(v) * BigInt::from(3).pow(120)).to_string();
            let n = (n & !0xffff) as f64; // exact in f64
            let d = u128::from(d.max(1));
            let got = round_ratio(&long(n as u128), &long(d)).expect("in range");
            assert_eq!(got.value, n / d as f64);
        }
    }

    #[test]
    fn faults_are_reported() {
        for (n, d) in [
            ("", "1"),
            ("1", "0"),
            ("1", "-2"),
            ("1.5", "1"),
            ("--1", "1"),
            ("1", "x"),
        ] {
            assert!(round_ratio(n, d).is_err(), "{n}/{d}");
        }
        assert!(round_ratio(&"9".repeat(400), "1").is_err());
        assert!(round_ratio(&"9".repeat(4000), "1").is_err());
    }
}
