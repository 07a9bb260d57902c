//! Rows of SQLite tables: variable-length integers and records of columns.

use std::io;

/// Fault of a database file.
#[derive(Debug)]
pub(super) enum RowFault {
    /// Unusable part of the file, and why.
    Field(&'static str, String),
    /// Error of the system, or the end of the file.
    Io(io::Error),
}

impl From<io::Error> for RowFault {
    fn from(e: io::Error) -> Self {
        Self::Io(e)
    }
}

/// Value of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ColumnValue<'a> {
    Null,
    Integer(i64),
    Bytes(&'a [u8]),
    /// Real numbers, of which none is needed.
    Real,
}

impl<'a> ColumnValue<'a> {
    /// The integer, if it is one.
    pub(super) fn integer(self) -> Option<i64> {
        match self {
            Self::Integer(i) => Some(i),
            _ => None,
        }
    }
    /// The bytes of a text or blob.
    pub(super) fn bytes(self) -> Option<&'a [u8]> {
        match self {
            Self::Bytes(b) => Some(b),
            _ => None,
        }
    }
    /// The text of a text or blob.
    pub(super) fn text(self) -> Option<&'a str> {
        std::str::from_utf8(self.bytes()?).ok()
    }
}

/// Takes a variable-length integer off the front: one to nine bytes, big-endian, seven bits each but the ninth.
pub(super) fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0u64;
    for i in 0..9 {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        if i == 8 {
            return Some(value << 8 | u64::from(byte));
        }
        value = value << 7 | u64::from(byte & 0x7f);
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}

/// Length of a column's value by its serial type; `None` for reserved types.
fn length(serial_type: u64) -> Option<usize> {
    match serial_type {
        0 | 8 | 9 => Some(0),
        1..=4 => Some(serial_type as usize),
        5 => Some(6),
        6 | 7 => Some(8),
        10 | 11 => None,
        n => usize::try_from((n - 12) / 2).ok(),
    }
}

/// Column `index` of a record; `None` if the record lacks it or its bytes.
pub(super) fn column(record: &[u8], index: usize) -> Option<ColumnValue<'_>> {
    let mut rest = record;
    let header_length = usize::try_from(varint(&mut rest)?).ok()?;
    let prefix = record.len() - rest.len();
    let mut types = record.get(prefix..header_length)?;
    let mut at = header_length;
    for _ in 0..index {
        at = at.checked_add(length(varint(&mut types)?)?)?;
    }
    let serial_type = varint(&mut types)?;
    let bytes = record.get(at..at.checked_add(length(serial_type)?)?)?;
    Some(match serial_type {
        0 => ColumnValue::Null,
        8 => ColumnValue::Integer(0),
        9 => ColumnValue::Integer(1),
        1..=6 => ColumnValue::Integer(signed(bytes)),
        7 => ColumnValue::Real,
        _ => ColumnValue::Bytes(bytes),
    })
}

/// Big-endian two's complement of one to eight bytes.
fn signed(bytes: &[u8]) -> i64 {
    let negative = bytes.first().is_some_and(|b| *b >= 0x80);
    let start = if negative { -1 } else { 0 };
    bytes.iter().fold(start, |v, b| v << 8 | i64::from(*b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn varints_have_one_to_nine_bytes() {
        for (bytes, value) in [
            (&[0x05][..], 5u64),
            (&[0x81, 0x00], 128),
            (&[0xff; 9], u64::MAX),
        ] {
            assert_eq!(varint(&mut &bytes[..]), Some(value));
        }
        assert_eq!(varint(&mut &[0x81][..]), None);
    }

    #[test]
    fn columns_are_read_by_their_types() {
        // Types: NULL, 2-byte integer, text of 3, blob of 2, constant 1.
        let record = [6, 0, 2, 19, 16, 9, 0xff, 0xfe, b'a', b'b', b'c', 7, 8];
        assert_eq!(column(&record, 0), Some(ColumnValue::Null));
        assert_eq!(column(&record, 1), Some(ColumnValue::Integer(-2)));
        assert_eq!(column(&record, 2).and_then(ColumnValue::text), Some("abc"));
        assert_eq!(column(&record, 3), Some(ColumnValue::Bytes(&[7, 8])));
        assert_eq!(column(&record, 4), Some(ColumnValue::Integer(1)));
        assert_eq!(column(&record, 5), None);
        for cut in 0..record.len() {
            let _ = column(&record[..cut], 3);
        }
        assert_eq!(column(&[0xff; 20], 0), None);
    }
}
