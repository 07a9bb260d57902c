//! Depth and colour images as files.

use super::jpeg::decode_jpeg_from;
use super::limits::{MAX_FILE_BYTES, read_limited};
use super::png_file::{decode_png_color, decode_png_depth, encode_png_depth, encode_png_rgb};
use crate::FormatError;
use std::path::Path;
use tryon_geometry::camera::{ColorImage, DepthImage};

/// Reads a 16-bit grey PNG; values in the file's own unit.
///
/// # Errors
/// Names the file and its fault; a truncated file is an error.
pub fn read_png_depth(path: &Path) -> Result<DepthImage, FormatError> {
    decode_png_depth(&read_limited(path, MAX_FILE_BYTES)?, path)
}

/// Writes a 16-bit grey PNG.
///
/// # Errors
/// When the file cannot be written.
pub fn write_png_depth(path: &Path, image: &DepthImage) -> Result<(), FormatError> {
    std::fs::write(path, encode_png_depth(image, path)?).map_err(|e| FormatError::io(path, e))
}

/// Reads a PNG or JPEG, by its first bytes; grey, palette and alpha images become RGB (alpha is dropped).
///
/// # Errors
/// Names the file and its fault.
pub fn read_color(path: &Path) -> Result<ColorImage, FormatError> {
    decode_color(&read_limited(path, MAX_FILE_BYTES)?, path)
}

/// Decodes PNG or JPEG bytes to RGB; `origin` is named in errors.
///
/// # Errors
/// As [`read_color`].
pub fn decode_color(bytes: &[u8], origin: &Path) -> Result<ColorImage, FormatError> {
    if bytes.starts_with(&[0xff, 0xd8]) {
        return decode_jpeg_from(bytes, origin);
    }
    decode_png_color(bytes, origin)
}

/// Writes an RGB PNG with fast compression.
///
/// # Errors
/// When the file cannot be written.
pub fn write_png_rgb(path: &Path, image: &ColorImage) -> Result<(), FormatError> {
    std::fs::write(path, encode_png_rgb(image, path)?).map_err(|e| FormatError::io(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_round_trip_and_a_missing_one_is_named() {
        let dir = tempfile::tempdir().expect("temporary folder");
        let depth = DepthImage::new(3, 2, vec![0, 1, 256, 4000, 65_535, 7]).expect("sizes");
        let path = dir.path().join("d.png");
        write_png_depth(&path, &depth).expect("written");
        assert_eq!(read_png_depth(&path).expect("read"), depth);
        let color = ColorImage::new(2, 1, vec![1, 2, 3, 250, 251, 252]).expect("sizes");
        write_png_rgb(&dir.path().join("c.png"), &color).expect("written");
        assert_eq!(read_color(&dir.path().join("c.png")).expect("read"), color);
        let e = read_color(&dir.path().join("no.png")).expect_err("missing");
        assert!(e.to_string().contains("no.png"), "{e}");
    }
}
