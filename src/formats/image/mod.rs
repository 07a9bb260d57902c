//! Depth and colour images as files and as bytes: PNG, JPEG and the depth codec of the wire.
//!
//! A size is checked against [`MAX_SIDE`], [`MAX_PIXELS`] and the number of bytes at hand before anything is allocated.

mod depth_codec;
mod jpeg;
mod png_file;

pub use depth_codec::{decode_depth, encode_depth};
pub use jpeg::{decode_jpeg, encode_jpeg};
pub use png_file::{decode_png_color, decode_png_depth, encode_png_depth, encode_png_rgb};

use super::FormatError;
use crate::camera::{ColorImage, DepthImage};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Longest side of an image, pixels: that of [`crate::camera::Intrinsics`].
pub const MAX_SIDE: u32 = 16_384;

/// Most pixels of an image: 64 Mpx, five times the largest depth-and-colour camera on sale. As colour that is 200 MB,
/// which a machine that runs this product survives.
pub const MAX_PIXELS: u64 = 1 << 26;

/// Largest image file: an uncompressed 16-bit image of [`MAX_PIXELS`] with room for its wrapping.
const MAX_FILE_BYTES: u64 = 4 * MAX_PIXELS;

/// Refuses sizes that no camera of this product delivers.
pub(super) fn check_size(origin: &Path, width: u32, height: u32) -> Result<(), FormatError> {
    for (field, side) in [("width", width), ("height", height)] {
        if side == 0 || side > MAX_SIDE {
            return Err(FormatError::field(
                origin,
                field,
                format!("{side}, expected 1 to {MAX_SIDE} pixels"),
            ));
        }
    }
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        let why = format!("{width}×{height} are more than {MAX_PIXELS} pixels");
        return Err(FormatError::field(origin, "width, height", why));
    }
    Ok(())
}

/// A whole file, refused above `limit` bytes.
pub(super) fn read_limited(path: &Path, limit: u64) -> Result<Vec<u8>, FormatError> {
    let io = |e| FormatError::io(path, e);
    let file = File::open(path).map_err(io)?;
    let size = file.metadata().map_err(io)?.len();
    if size > limit {
        return Err(FormatError::field(
            path,
            "file size",
            format!("{size} bytes, expected at most {limit}"),
        ));
    }
    let mut bytes = Vec::with_capacity(size as usize);
    // `take`: the file may grow while it is read.
    file.take(limit).read_to_end(&mut bytes).map_err(io)?;
    Ok(bytes)
}

/// Reads a 16-bit grey PNG as it is: values in the file's own unit.
///
/// # Errors
/// Names the file and what is wrong with it; a cut file is an error.
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

/// Reads a PNG or JPEG, told apart by their first bytes; grey, palette and alpha images become RGB (alpha is dropped).
///
/// # Errors
/// Names the file and what is wrong with it.
pub fn read_color(path: &Path) -> Result<ColorImage, FormatError> {
    decode_color(&read_limited(path, MAX_FILE_BYTES)?, path)
}

/// PNG or JPEG bytes to RGB; `origin` is named in errors.
///
/// # Errors
/// As [`read_color`].
pub fn decode_color(bytes: &[u8], origin: &Path) -> Result<ColorImage, FormatError> {
    if bytes.starts_with(&[0xff, 0xd8]) {
        return jpeg::decode_jpeg_from(bytes, origin);
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
    fn sizes_are_refused_by_name() {
        let at = Path::new("x.png");
        assert!(check_size(at, 640, 480).is_ok());
        assert!(
            check_size(at, 60_000, 2)
                .expect_err("wide")
                .to_string()
                .contains("`width`")
        );
        assert!(
            check_size(at, 2, 0)
                .expect_err("flat")
                .to_string()
                .contains("`height`")
        );
        assert!(check_size(at, 16_384, 16_384).is_err());
    }

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
