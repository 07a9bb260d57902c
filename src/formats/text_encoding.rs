//! Text of files by their byte order mark: UTF-8, or UTF-16 as Windows editors save it.

use std::borrow::Cow;

/// Text of a file without its mark. Without a mark UTF-16 is told by the zeros of its first letters; bytes that are neither
/// encoding become U+FFFD.
pub(super) fn decode_text(bytes: &[u8]) -> Cow<'_, str> {
    let zero_at = |k: usize| bytes.get(k) == Some(&0);
    match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => String::from_utf8_lossy(rest),
        [0xff, 0xfe, rest @ ..] => wide(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => wide(rest, u16::from_be_bytes),
        _ if zero_at(1) && zero_at(3) => wide(bytes, u16::from_le_bytes),
        _ if zero_at(0) && zero_at(2) => wide(bytes, u16::from_be_bytes),
        _ => String::from_utf8_lossy(bytes),
    }
}

fn wide(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Cow<'static, str> {
    let units: Vec<u16> = bytes.as_chunks::<2>().0.iter().map(|b| unit(*b)).collect();
    String::from_utf16_lossy(&units).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_read_and_left_out() {
        let text = "ROOT Hüfte\n";
        let wide =
            |order: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(order).collect::<Vec<u8>>();
        let with = |mark: &[u8], rest: &[u8]| [mark, rest].concat();
        for bytes in [
            text.as_bytes().to_vec(),
            with(&[0xef, 0xbb, 0xbf], text.as_bytes()),
            with(&[0xff, 0xfe], &wide(u16::to_le_bytes)),
            with(&[0xfe, 0xff], &wide(u16::to_be_bytes)),
            wide(u16::to_le_bytes),
            wide(u16::to_be_bytes),
        ] {
            assert_eq!(decode_text(&bytes), text);
        }
        assert_eq!(decode_text(b"o Kost\xfcm"), "o Kost\u{fffd}m");
    }
}
