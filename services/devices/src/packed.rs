//! Rows of an image without the padding between them.

use super::driver::StreamFormat;

/// The image's rows, one after another, of bytes with `stride` from row to row.
///
/// # Errors
/// Rows that overlap, or too few bytes for the format.
pub(crate) fn packed_rows(
    mut bytes: Vec<u8>,
    stride: usize,
    format: &StreamFormat,
) -> Result<Vec<u8>, String> {
    let Some(pixel) = format.encoding.pixel_bytes() else {
        return Ok(bytes);
    };
    let (row, rows) = (pixel * format.width as usize, format.height as usize);
    let (got, least) = (bytes.len(), stride * rows.saturating_sub(1) + row);
    if stride < row || got < least {
        return Err(format!(
            "{got} bytes with {stride} a row, expected {least} with {row}"
        ));
    }
    if stride == row {
        bytes.truncate(row * rows);
        return Ok(bytes);
    }
    let lines = bytes.chunks(stride).take(rows);
    Ok(lines.flat_map(|line| &line[..row]).copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::Encoding;

    fn rows(encoding: Encoding, stride: usize, bytes: u8) -> Result<Vec<u8>, String> {
        let format = StreamFormat {
            encoding,
            width: 2,
            height: 3,
            rate: 30.0,
        };
        packed_rows((0..bytes).collect(), stride, &format)
    }

    #[test]
    fn padding_between_rows_is_left_out() {
        let of = |stride, bytes| rows(Encoding::Depth16, stride, bytes);
        assert_eq!(of(4, 12), Ok((0..12).collect()));
        assert_eq!(of(4, 14), Ok((0..12).collect()));
        assert_eq!(of(6, 16), Ok(vec![0, 1, 2, 3, 6, 7, 8, 9, 12, 13, 14, 15]));
        for (stride, bytes) in [(4, 11), (3, 12), (0, 12), (6, 15)] {
            let why = of(stride, bytes).expect_err("too few");
            assert!(why.contains("expected"), "{why}");
        }
        assert_eq!(rows(Encoding::Jpeg, 0, 5), Ok((0..5).collect()));
    }
}
