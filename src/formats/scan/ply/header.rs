//! Header of a PLY file: encoding, elements and their properties.

use crate::FormatError;
use std::path::Path;

/// Number format of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PlyScalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl PlyScalar {
    fn parse(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Size in a binary file, bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// Type of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PlyType {
    /// One number.
    Scalar(PlyScalar),
    /// Number of items, then the items.
    List { count: PlyScalar, item: PlyScalar },
}

/// Property of an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlyProperty {
    pub(super) name: String,
    pub(super) kind: PlyType,
}

/// Table of a file: rows of the same properties.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlyElement {
    pub(super) name: String,
    pub(super) rows: u64,
    pub(super) properties: Vec<PlyProperty>,
}

/// Encoding of the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PlyEncoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Header of a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlyHeader {
    pub(super) encoding: PlyEncoding,
    pub(super) elements: Vec<PlyElement>,
    /// Offset of the first number, bytes.
    pub(super) end: usize,
}

/// Parses the header and checks the number of rows against the size of the file.
///
/// # Errors
/// Names the header line or element at fault.
pub(super) fn parse_header(bytes: &[u8], origin: &Path) -> Result<PlyHeader, FormatError> {
    let mut lines = HeaderLines::new(bytes);
    if lines.next().as_deref() != Some("ply") {
        return Err(FormatError::field(origin, "header", "it is no PLY file"));
    }
    let (mut encoding, mut elements) = (None, Vec::<PlyElement>::new());
    let mut number = 1;
    loop {
        number += 1;
        let fault = |why: String| FormatError::field(origin, format!("header line {number}"), why);
        let line = lines
            .next()
            .ok_or_else(|| fault("the file is cut short before `end_header`".into()))?;
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["end_header"] => break,
            ["format", name, _] => {
                let parsed = parse_encoding(name);
                encoding = Some(parsed.ok_or_else(|| fault(format!("unknown format `{name}`")))?);
            }
            ["element", name, rows] => elements.push(PlyElement {
                name: name.to_owned(),
                rows: rows
                    .parse()
                    .map_err(|_| fault(format!("`{rows}` is no number of rows")))?,
                properties: Vec::new(),
            }),
            ["property", ..] => {
                let property = parse_property(&words).map_err(fault)?;
                let element = elements.last_mut();
                let element = element.ok_or_else(|| fault("property before element".into()))?;
                element.properties.push(property);
            }
            [] | ["comment" | "obj_info", ..] => {}
            _ => return Err(fault(format!("`{line}` is no header line"))),
        }
    }
    let header = PlyHeader {
        encoding: encoding.ok_or_else(|| FormatError::field(origin, "format", "missing"))?,
        elements,
        end: lines.at,
    };
    check_rows(&header, bytes.len(), origin)?;
    Ok(header)
}

fn parse_encoding(name: &str) -> Option<PlyEncoding> {
    match name {
        "ascii" => Some(PlyEncoding::Ascii),
        "binary_little_endian" => Some(PlyEncoding::LittleEndian),
        "binary_big_endian" => Some(PlyEncoding::BigEndian),
        _ => None,
    }
}

/// Property of the words of its line.
fn parse_property(words: &[&str]) -> Result<PlyProperty, String> {
    let scalar =
        |word: &str| PlyScalar::parse(word).ok_or_else(|| format!("unknown type `{word}`"));
    let (kind, name) = match *words {
        ["property", "list", count, item, name] => {
            let (count, item) = (scalar(count)?, scalar(item)?);
            (PlyType::List { count, item }, name)
        }
        ["property", kind, name] => (PlyType::Scalar(scalar(kind)?), name),
        _ => return Err(format!("`{}` is no property", words.join(" "))),
    };
    Ok(PlyProperty {
        name: name.to_owned(),
        kind,
    })
}

/// Checks that the file is long enough for the least size of all rows.
fn check_rows(header: &PlyHeader, file_size: usize, origin: &Path) -> Result<(), FormatError> {
    let is_ascii = header.encoding == PlyEncoding::Ascii;
    // The last number of an ASCII file may lack its separator.
    let mut left = (file_size - header.end.min(file_size)) as u64 + u64::from(is_ascii);
    for element in &header.elements {
        let least = |p: &PlyProperty| match p.kind {
            // A digit and a separator.
            _ if is_ascii => 2,
            PlyType::Scalar(scalar) | PlyType::List { count: scalar, .. } => scalar.size() as u64,
        };
        let row: u64 = element.properties.iter().map(least).sum();
        let need = row.checked_mul(element.rows);
        left = need.and_then(|n| left.checked_sub(n)).ok_or_else(|| {
            let (name, rows) = (&element.name, element.rows);
            let why = format!("{rows} rows are more than the file holds: it is cut short");
            FormatError::field(origin, format!("element {name}"), why)
        })?;
    }
    Ok(())
}

/// Lines of a header, which end as its first line does: in `\n`, `\r\n` or `\r`.
struct HeaderLines<'a> {
    bytes: &'a [u8],
    at: usize,
    end: u8,
}

impl<'a> HeaderLines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        let is_classic_mac = bytes.get(3) == Some(&b'\r') && bytes.get(4) != Some(&b'\n');
        Self {
            bytes,
            at: 0,
            end: if is_classic_mac { b'\r' } else { b'\n' },
        }
    }
}

impl Iterator for HeaderLines<'_> {
    type Item = String;

    /// Next line, trimmed; `None` at the end of the file.
    fn next(&mut self) -> Option<String> {
        let rest = self.bytes.get(self.at..)?;
        let length = rest.iter().position(|b| *b == self.end)?;
        self.at += length + 1;
        let line = String::from_utf8_lossy(rest.get(..length)?);
        Some(line.trim().to_owned())
    }
}
