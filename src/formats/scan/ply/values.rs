//! Numbers of a PLY file, one after the other.

use super::header::{PlyEncoding, PlyScalar};

/// Fault of a number.
#[derive(Debug, PartialEq)]
pub(super) enum ValueFault {
    /// The file ends before it.
    Cut,
    /// Text that is no number.
    NoNumber(String),
    /// Number that is negative, broken or beyond 32 bits.
    NoIndex(f64),
}

impl std::fmt::Display for ValueFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Cut => f.write_str("the file is cut short"),
            Self::NoNumber(text) => write!(f, "`{text}` is no number"),
            Self::NoIndex(value) => write!(f, "{value} is no count or index"),
        }
    }
}

/// Cursor over the numbers after the header.
pub(super) struct PlyValues<'a> {
    bytes: &'a [u8],
    encoding: PlyEncoding,
}

impl<'a> PlyValues<'a> {
    /// Numbers of `bytes`, which follow the header.
    pub(super) fn new(bytes: &'a [u8], encoding: PlyEncoding) -> Self {
        Self { bytes, encoding }
    }

    /// Next number; f64 holds every type exactly.
    pub(super) fn next(&mut self, kind: PlyScalar) -> Result<f64, ValueFault> {
        match self.encoding {
            PlyEncoding::Ascii => self.next_word(),
            PlyEncoding::LittleEndian => self.next_binary(kind, false),
            PlyEncoding::BigEndian => self.next_binary(kind, true),
        }
    }

    fn next_word(&mut self) -> Result<f64, ValueFault> {
        let rest = self.bytes.trim_ascii_start();
        let end = rest.iter().position(u8::is_ascii_whitespace);
        let (word, rest) = rest.split_at(end.unwrap_or(rest.len()));
        self.bytes = rest;
        if word.is_empty() {
            return Err(ValueFault::Cut);
        }
        let text = String::from_utf8_lossy(word);
        // C libraries also print `-nan(ind)` and `nan(snan)`.
        let unsigned = text.trim_start_matches(['-', '+']).as_bytes();
        if unsigned
            .get(..3)
            .is_some_and(|n| n.eq_ignore_ascii_case(b"nan"))
        {
            return Ok(f64::NAN);
        }
        let value = text.parse();
        value.map_err(|_| ValueFault::NoNumber(text.into_owned()))
    }

    fn next_binary(&mut self, kind: PlyScalar, is_big: bool) -> Result<f64, ValueFault> {
        let (value, rest) = self
            .bytes
            .split_at_checked(kind.size())
            .ok_or(ValueFault::Cut)?;
        self.bytes = rest;
        let mut b = [0; 8];
        for (to, from) in b.iter_mut().zip(value) {
            *to = *from;
        }
        if is_big {
            b[..kind.size()].reverse();
        }
        let [b0, b1, b2, b3, ..] = b;
        Ok(match kind {
            PlyScalar::I8 => i8::from_le_bytes([b0]).into(),
            PlyScalar::U8 => b0.into(),
            PlyScalar::I16 => i16::from_le_bytes([b0, b1]).into(),
            PlyScalar::U16 => u16::from_le_bytes([b0, b1]).into(),
            PlyScalar::I32 => i32::from_le_bytes([b0, b1, b2, b3]).into(),
            PlyScalar::U32 => u32::from_le_bytes([b0, b1, b2, b3]).into(),
            PlyScalar::F32 => f32::from_le_bytes([b0, b1, b2, b3]).into(),
            PlyScalar::F64 => f64::from_le_bytes(b),
        })
    }

    /// Next number as a count or an index.
    pub(super) fn next_index(&mut self, kind: PlyScalar) -> Result<u32, ValueFault> {
        let value = self.next(kind)?;
        let index = value as u32;
        if f64::from(index) == value {
            Ok(index)
        } else {
            Err(ValueFault::NoIndex(value))
        }
    }
}
