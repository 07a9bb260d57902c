//! EBML elements (RFC 8794): an identifier, a size and a payload.

/// Longest header, bytes: four of the identifier, eight of the size.
pub(super) const MAX_HEADER: usize = 12;

/// Header of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ElementHeader {
    /// Identifier with its length marker.
    pub(super) id: u32,
    /// Size of the payload, bytes; `None` if the element ends with its parent.
    pub(super) size: Option<u64>,
    /// Size of the header itself, bytes.
    pub(super) length: u64,
}

impl ElementHeader {
    /// Header at the start of `bytes`; `None` where none begins or it is cut.
    pub(super) fn parse(bytes: &[u8]) -> Option<Self> {
        let id_length = bytes.first()?.leading_zeros() as usize + 1;
        if id_length > 4 {
            return None;
        }
        let id = big_endian(bytes.get(..id_length)?) as u32;
        let (size, size_length) = variable(&bytes[id_length..])?;
        Some(Self {
            id,
            size,
            length: (id_length + size_length) as u64,
        })
    }
}

/// Variable-length number without its marker, and its length in bytes. All ones are `None`, "unknown".
pub(super) fn variable(bytes: &[u8]) -> Option<(Option<u64>, usize)> {
    let length = bytes.first()?.leading_zeros() as usize + 1;
    if length > 8 {
        return None;
    }
    let mask = (1u64 << (7 * length)) - 1;
    let value = big_endian(bytes.get(..length)?) & mask;
    Some(((value != mask).then_some(value), length))
}

/// Big-endian number of at most eight bytes.
fn big_endian(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0, |n, b| n << 8 | u64::from(*b))
}

/// Value of an unsigned-integer payload; `None` above eight bytes.
pub(super) fn unsigned(payload: &[u8]) -> Option<u64> {
    (payload.len() <= 8).then(|| big_endian(payload))
}

/// Text of a string payload, up to its first NUL.
pub(super) fn text(payload: &[u8]) -> String {
    let end = payload.iter().position(|b| *b == 0);
    String::from_utf8_lossy(&payload[..end.unwrap_or(payload.len())]).into_owned()
}

/// Children of a master element in memory: identifier and payload, up to the first damaged one.
pub(super) fn children(payload: &[u8]) -> impl Iterator<Item = (u32, &[u8])> {
    let mut rest = payload;
    std::iter::from_fn(move || {
        let header = ElementHeader::parse(rest)?;
        let start = header.length as usize;
        let size = usize::try_from(header.size?).ok()?;
        let child = rest.get(start..start.checked_add(size)?)?;
        rest = &rest[start + size..];
        Some((header.id, child))
    })
}

/// First child with an identifier.
pub(super) fn child(payload: &[u8], id: u32) -> Option<&[u8]> {
    children(payload).find(|(i, _)| *i == id).map(|(_, c)| c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_follow_the_standard() {
        let header = |bytes: &[u8]| ElementHeader::parse(bytes).map(|h| (h.id, h.size, h.length));
        assert_eq!(header(&[0xa3, 0x81]), Some((0xa3, Some(1), 2)));
        assert_eq!(
            header(&[
                0x1f, 0x43, 0xb6, 0x75, 0x01, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff
            ]),
            Some((0x1f43_b675, None, 12))
        );
        let two = [0x42, 0x86, 0x40, 0x02];
        assert_eq!(header(&two), Some((0x4286, Some(2), 4)));
        for bad in [
            &[][..],
            &[0x08, 0x81],
            &[0xa3, 0x00],
            &[0x42],
            &[0xa3, 0x40],
        ] {
            assert_eq!(header(bad), None, "{bad:?}");
        }
    }

    #[test]
    fn children_end_at_damage() {
        let bytes = [0xd7, 0x81, 7, 0x86, 0x83, b'a', b'b', 0, 0xd7, 0x85, 1];
        let found: Vec<_> = children(&bytes).collect();
        assert_eq!(found, [(0xd7, &[7u8][..]), (0x86, &b"ab\0"[..])]);
        assert_eq!(child(&bytes, 0x86).map(text).as_deref(), Some("ab"));
        assert_eq!(child(&bytes, 0xd7).and_then(unsigned), Some(7));
        assert_eq!(unsigned(&[0; 9]), None);
    }
}
