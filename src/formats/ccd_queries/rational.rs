//! Ratio of two decimal integers of any length, correctly rounded to f64.

/// Decimal digits of one integer. More than the exact quotients of any two f64 need.
const MAX_DIGITS: usize = 2048;
/// Bits of the integer quotient: 53 of the significand, and at least two for rounding.
const QUOTIENT_BITS: i64 = 55;
/// Powers of two within which quotients are normal numbers.
const MAX_SHIFT: i64 = 960;

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
    let (is_negative, digits) = match numerator.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, numerator),
    };
    let (n, d) = (magnitude(digits)?, magnitude(denominator)?);
    if d.is_empty() {
        return Err("the denominator is 0".to_owned());
    }
    let magnitude = round_quotient(n, d)?;
    Ok(Rounded {
        value: if is_negative {
            -magnitude.value
        } else {
            magnitude.value
        },
        ..magnitude
    })
}

/// Binary magnitude, least significant word first, without leading zeros.
type Words = Vec<u32>;

fn magnitude(digits: &str) -> Result<Words, String> {
    let is_number = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
    if !is_number || digits.len() > MAX_DIGITS {
        let shown: String = digits.chars().take(24).collect();
        return Err(format!(
            "`{shown}` is not an integer (the denominator unsigned) of at most {MAX_DIGITS} digits"
        ));
    }
    let mut words = Words::new();
    for b in digits.bytes() {
        let mut carry = u64::from(b - b'0');
        for w in &mut words {
            carry += u64::from(*w) * 10;
            *w = carry as u32;
            carry >>= 32;
        }
        if carry > 0 {
            words.push(carry as u32);
        }
    }
    Ok(words)
}

/// The value if f64 holds it exactly.
fn exact_f64(words: &[u32]) -> Option<f64> {
    let value = words
        .iter()
        .rev()
        .fold(0u128, |v, w| v << 32 | u128::from(*w));
    (words.len() <= 3 && value as f64 as u128 == value).then_some(value as f64)
}

fn round_quotient(n: Words, d: Words) -> Result<Rounded, String> {
    if n.is_empty() {
        return Ok(Rounded {
            value: 0.0,
            is_exact: true,
        });
    }
    if let (Some(n), Some(d)) = (exact_f64(&n), exact_f64(&d)) {
        let value = n / d;
        let is_exact = value.mul_add(d, -n) == 0.0;
        return Ok(Rounded { value, is_exact });
    }
    divide(n, d)
}

/// Integer division with a sticky bit for the remainder.
fn divide(mut n: Words, mut d: Words) -> Result<Rounded, String> {
    let shift = QUOTIENT_BITS - (bits(&n) - bits(&d));
    if shift.abs() > MAX_SHIFT {
        return Err("the quotient is beyond the range of f64".to_owned());
    }
    shift_left(&mut n, shift.max(0) as usize);
    shift_left(&mut d, (-shift).max(0) as usize + QUOTIENT_BITS as usize);
    let mut quotient = 0u64;
    for _ in 0..=QUOTIENT_BITS {
        quotient <<= 1;
        if is_less_or_equal(&d, &n) {
            subtract(&mut n, &d);
            quotient |= 1;
        }
        halve(&mut d);
    }
    let is_exact = n.iter().all(|w| *w == 0) && (quotient as f64) as u64 == quotient;
    let sticky = u64::from(!n.iter().all(|w| *w == 0));
    Ok(Rounded {
        value: (quotient | sticky) as f64 * 2f64.powi(-shift as i32),
        is_exact,
    })
}

fn bits(words: &[u32]) -> i64 {
    let top = words
        .last()
        .map_or(0, |w| 32 - i64::from(w.leading_zeros()));
    (words.len().max(1) as i64 - 1) * 32 + top
}

fn shift_left(words: &mut Words, by: usize) {
    let mut carry = 0u64;
    for w in words.iter_mut() {
        carry |= u64::from(*w) << (by % 32);
        *w = carry as u32;
        carry >>= 32;
    }
    words.push(carry as u32);
    words.splice(0..0, std::iter::repeat_n(0, by / 32));
    trim(words);
}

fn halve(words: &mut Words) {
    let mut high = 0;
    for w in words.iter_mut().rev() {
        let low = *w & 1;
        *w = *w >> 1 | high << 31;
        high = low;
    }
    trim(words);
}

fn trim(words: &mut Words) {
    while words.last() == Some(&0) {
        words.pop();
    }
}

fn is_less_or_equal(a: &[u32], b: &[u32]) -> bool {
    let order = a.len().cmp(&b.len());
    order
        .then_with(|| a.iter().rev().cmp(b.iter().rev()))
        .is_le()
}

fn subtract(a: &mut Words, b: &[u32]) {
    let mut borrow = 0i64;
    for (i, w) in a.iter_mut().enumerate() {
        borrow += i64::from(*w) - i64::from(b.get(i).copied().unwrap_or(0));
        *w = borrow as u32;
        borrow >>= 32;
    }
    trim(a);
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
            // Times 3^80 in decimal is too long for the short path.
            let long = |v: u128| {
                let mut words = magnitude(&v.to_string()).expect("a number");
                for _ in 0..120 {
                    let mut carry = 0u64;
                    for w in &mut words {
                        carry += u64::from(*w) * 3;
                        *w = carry as u32;
                        carry >>= 32;
                    }
                    words.extend((carry > 0).then_some(carry as u32));
                }
                words
            };
            let n = n & !0xffff; // exact in f64
            let n = (n as f64) as u128;
            let got = divide(long(n), long(u128::from(d))).expect("in range");
            assert_eq!(got.value, n as f64 / d as f64);
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
