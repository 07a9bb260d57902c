//! Arrays in NumPy's npy format.

use super::FormatError;
use npyz::WriterBuilder;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Writes `data` in C order with this shape, little-endian f32.
///
/// # Errors
/// When the shape does not hold the data, or the file cannot be written.
pub fn write_npy(
    path: &Path,
    shape: &[u64],
    data: impl ExactSizeIterator<Item = f32>,
) -> Result<(), FormatError> {
    let expected: u64 = shape.iter().product();
    if expected != data.len() as u64 {
        return Err(FormatError::field(
            path,
            "shape",
            format!("{shape:?} does not hold {} values", data.len()),
        ));
    }
    let io = |e| FormatError::io(path, e);
    let file = BufWriter::new(File::create(path).map_err(io)?);
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(shape)
        .writer(file)
        .begin_nd()
        .map_err(io)?;
    writer.extend(data).map_err(io)?;
    writer.finish().map_err(io)
}

/// Reads an array of f16, f32 or f64 in C order: its shape, and its values as f32.
///
/// # Errors
/// When the file cannot be read, holds another type, or is truncated.
pub fn read_npy(path: &Path) -> Result<(Vec<u64>, Vec<f32>), FormatError> {
    let io = |e| FormatError::io(path, e);
    let bytes = std::fs::read(path).map_err(io)?;
    let start = data_start(&bytes).filter(|s| *s <= bytes.len());
    let Some(start) = start else {
        let why = "it is longer than the file";
        return Err(FormatError::field(path, "header length", why));
    };
    if !is_flat_header(&bytes[..start]) {
        let why = "it nests more than an array's";
        return Err(FormatError::field(path, "header", why));
    }
    let header = npyz::NpyFile::new(&bytes[..]).map_err(io)?;
    let shape = header.shape().to_vec();
    let descr = header.dtype().descr();
    let width = match descr.trim_matches('\'') {
        "<f2" => 2,
        "<f4" => 4,
        "<f8" => 8,
        other => {
            return Err(FormatError::field(
                path,
                "descr",
                format!("{other}: expected <f2, <f4 or <f8"),
            ));
        }
    };
    if header.order() != npyz::Order::C {
        return Err(FormatError::field(
            path,
            "fortran_order",
            "expected C order",
        ));
    }
    let wanted = shape
        .iter()
        .try_fold(width as u64, |n, s| n.checked_mul(*s))
        .and_then(|n| usize::try_from(n).ok());
    let Some(data) = wanted.and_then(|n| bytes.get(start..start.checked_add(n)?)) else {
        return Err(FormatError::field(
            path,
            "shape",
            format!("{shape:?} is more than the file holds"),
        ));
    };
    let values = match width {
        2 => data
            .chunks_exact(2)
            .map(|b| half(u16::from_le_bytes([b[0], b[1]])))
            .collect(),
        4 => data
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect(),
        _ => data
            .chunks_exact(8)
            .map(|b| f64::from_le_bytes(std::array::from_fn(|i| b[i])) as f32)
            .collect(),
    };
    Ok((shape, values))
}

/// Offset of the values as the file states it; npyz allocates the stated header, so it is checked first.
///
/// Magic (6 bytes), version (2), length of the header (2 bytes in version 1, 4 later), header, values.
pub(super) fn data_start(bytes: &[u8]) -> Option<usize> {
    match bytes.get(6..12)? {
        [1, _, a, b, ..] => Some(10 + usize::from(u16::from_le_bytes([*a, *b]))),
        [_, _, a, b, c, d] => 12usize.checked_add(u32::from_le_bytes([*a, *b, *c, *d]) as usize),
        _ => None,
    }
}

/// True if a header nests no deeper than an array's does: the parser of its Python literal recurses with every bracket.
pub(super) fn is_flat_header(header: &[u8]) -> bool {
    const MAX_BRACKETS: usize = 16;
    let opening = header.iter().filter(|b| b"([{".contains(b));
    opening.count() <= MAX_BRACKETS
}

/// Value of an IEEE 754 binary16 number.
pub(super) fn half(bits: u16) -> f32 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (
        i32::from(bits >> 10 & 0x1f),
        f32::from(bits & 0x3ff) / 1024.0,
    );
    match exponent {
        0 => sign * fraction * 2f32.powi(-14),
        31 if fraction == 0.0 => sign * f32::INFINITY,
        31 => f32::NAN,
        e => sign * (1.0 + fraction) * 2f32.powi(e - 15),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shape_and_values_come_back() {
        let dir = tempfile::tempdir().expect("temporary folder");
        let path = dir.path().join("a.npy");
        write_npy(&path, &[2, 1, 3], (0..6).map(|i| i as f32)).expect("written");
        let bytes = std::fs::read(&path).expect("read");
        let back = npyz::NpyFile::new(&bytes[..]).expect("a header");
        assert_eq!(back.shape(), [2, 1, 3]);
        assert_eq!(
            back.into_vec::<f32>().expect("values"),
            [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
        );
        assert!(write_npy(&path, &[2, 2], (0..6).map(|i| i as f32)).is_err());
    }

    #[test]
    fn arrays_come_back_and_halves_are_read() {
        let dir = tempfile::tempdir().expect("temporary folder");
        let path = dir.path().join("a.npy");
        write_npy(&path, &[2, 3], (0..6).map(|i| i as f32 - 2.5)).expect("written");
        let (shape, values) = read_npy(&path).expect("read");
        assert_eq!(
            (shape, values),
            (vec![2, 3], vec![-2.5, -1.5, -0.5, 0.5, 1.5, 2.5])
        );
        let mut bytes = std::fs::read(&path).expect("read");
        bytes.truncate(bytes.len() - 1);
        std::fs::write(&path, bytes).expect("written");
        assert!(read_npy(&path).is_err(), "a cut file");
        for (bits, value) in [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x3555, 0.333_251_95),
            (0x0001, 5.960_464_5e-8),
            (0, 0.0),
        ] {
            assert_eq!(half(bits), value);
        }
        assert!(half(0x7e00).is_nan() && half(0x7c00) == f32::INFINITY);
    }
}
