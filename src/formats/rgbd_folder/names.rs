//! Numbers and times in the names of images.

use std::cmp::Ordering;

/// Order of names in which a run of digits counts as one number: `2.png` before `10.png`.
pub(super) fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut x, mut y) = (a.as_bytes(), b.as_bytes());
    loop {
        let (left, right) = (digits(x), digits(y));
        let order = if left.is_empty() || right.is_empty() {
            match (x.first(), y.first()) {
                (None, None) => return a.cmp(b),
                (p, q) => {
                    let order = p.cmp(&q);
                    (x, y) = (
                        x.get(1..).unwrap_or_default(),
                        y.get(1..).unwrap_or_default(),
                    );
                    order
                }
            }
        } else {
            (x, y) = (&x[left.len()..], &y[right.len()..]);
            let (left, right) = (without_zeros(left), without_zeros(right));
            left.len().cmp(&right.len()).then_with(|| left.cmp(right))
        };
        if order != Ordering::Equal {
            return order;
        }
    }
}

/// Leading digits.
fn digits(text: &[u8]) -> &[u8] {
    let end = text.iter().position(|b| !b.is_ascii_digit());
    &text[..end.unwrap_or(text.len())]
}

fn without_zeros(digits: &[u8]) -> &[u8] {
    let first = digits.iter().position(|b| *b != b'0');
    &digits[first.unwrap_or(digits.len())..]
}

/// File name without folders and extension.
pub(super) fn stem(file: &str) -> &str {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

/// Number of a frame: the last run of digits in its name.
pub(super) fn frame_number(file: &str) -> Option<u64> {
    let stem = stem(file);
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let start = stem[..end].rfind(|c: char| !c.is_ascii_digit());
    let start = start.map_or(0, |i| {
        i + stem[i..].chars().next().map_or(1, char::len_utf8)
    });
    stem[start..end].parse().ok()
}

/// Parses decimal seconds as nanoseconds, digit by digit: f64 cannot hold nanoseconds since 1970.
pub(super) fn nanoseconds(text: &str) -> Option<u64> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let digits = |s: &str| s.bytes().all(|b| b.is_ascii_digit());
    if whole.is_empty() || !digits(whole) || !digits(fraction) {
        return None;
    }
    let nanos: String = fraction
        .chars()
        .chain(std::iter::repeat('0'))
        .take(9)
        .collect();
    whole
        .parse::<u64>()
        .ok()?
        .checked_mul(1_000_000_000)?
        .checked_add(nanos.parse().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn digits_count_as_numbers() {
        let mut names = vec![
            "10.png", "9.png", "a10b2", "a9b10", "010.png", "a9b9", "0.png", "",
        ];
        names.sort_by(|a, b| natural_order(a, b));
        let expected = [
            "", "0.png", "9.png", "010.png", "10.png", "a9b9", "a9b10", "a10b2",
        ];
        assert_eq!(names, expected);
    }

    #[test]
    fn the_last_number_is_the_frames() {
        for (file, number) in [
            ("rgb/0012.png", Some(12)),
            ("d/frame-000007.depth.png", Some(7)),
            ("cam2_15.jpg", Some(15)),
            ("ü3ö.png", Some(3)),
            ("depth.png", None),
            ("99999999999999999999999.png", None),
        ] {
            assert_eq!(frame_number(file), number, "{file}");
        }
    }

    #[test]
    fn seconds_keep_every_digit() {
        assert_eq!(
            nanoseconds("1305031102.175304"),
            Some(1_305_031_102_175_304_000)
        );
        assert_eq!(nanoseconds("0.033333"), Some(33_333_000));
        assert_eq!(nanoseconds("7"), Some(7_000_000_000));
        for bad in ["", ".5", "-1", "nan", "1e3", "99999999999999"] {
            assert_eq!(nanoseconds(bad), None, "{bad}");
        }
    }

    proptest! {
        /// Numbers without leading zeros sort as numbers, and any names have one order.
        #[test]
        fn the_order_is_that_of_numbers(a in 0u64.., b in 0u64.., x in "[a0-2.]{0,6}", y in "[a0-2.]{0,6}") {
            prop_assert_eq!(natural_order(&a.to_string(), &b.to_string()), a.cmp(&b));
            prop_assert_eq!(natural_order(&x, &y), natural_order(&y, &x).reverse());
            prop_assert_eq!(natural_order(&x, &y).is_eq(), x == y);
        }
    }
}
