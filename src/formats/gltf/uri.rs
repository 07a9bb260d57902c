//! Bytes that a glTF URI names: data URIs and files beside the document.

use crate::FormatError;
use crate::image::read_limited;
use crate::sibling::sibling;
use std::path::Path;

/// Largest file; a garment of 100,000 vertices takes 4 MB without its textures.
pub(super) const MAX_BYTES: u64 = 512 << 20;

/// Bytes of a data URI, or of a file in the folder of `origin`.
pub(super) fn external(uri: &str, origin: &Path, field: &str) -> Result<Vec<u8>, FormatError> {
    if let Some(data) = uri.strip_prefix("data:") {
        let text = data.split_once(";base64,").map(|d| d.1);
        let bytes = text.and_then(base64);
        return bytes
            .ok_or_else(|| FormatError::field(origin, field, "a data URI that is no base64"));
    }
    let path = sibling(origin, &percent_decoded(uri)).ok_or_else(|| {
        FormatError::field(origin, field, format!("`{uri}` leads out of the folder"))
    })?;
    read_limited(&path, MAX_BYTES)
}

/// Text with its percent-encoded bytes decoded (RFC 3986, section 2.1).
fn percent_decoded(text: &str) -> String {
    let mut parts = text.split('%');
    let mut out = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        let code = part.get(..2).and_then(|h| u8::from_str_radix(h, 16).ok());
        match (code, part.get(2..)) {
            (Some(byte), Some(rest)) => {
                out.push(byte);
                out.extend(rest.bytes());
            }
            _ => {
                out.push(b'%');
                out.extend(part.bytes());
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// Decodes base64 (RFC 4648, section 4).
fn base64(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut have) = (0u32, 0);
    for c in text.trim_end_matches('=').bytes() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        have += 6;
        if have >= 8 {
            have -= 8;
            out.push((bits >> have) as u8);
            bits &= (1 << have) - 1;
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percent_codes_are_decoded_and_others_kept() {
        for (text, want) in [
            ("a%20b", "a b"),
            ("%C3%A9", "é"),
            ("5%", "5%"),
            ("%zz", "%zz"),
        ] {
            assert_eq!(percent_decoded(text), want);
        }
    }

    #[test]
    fn base64_matches_the_vectors_of_rfc_4648() {
        for (text, want) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYmFy", "foobar"),
        ] {
            assert_eq!(base64(text).as_deref(), Some(want.as_bytes()));
        }
        assert_eq!(base64("Zm9*"), None);
    }
}
