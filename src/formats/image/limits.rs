//! Limits of image sizes and of file sizes, checked before anything is allocated.

use crate::FormatError;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Longest side of an image, pixels: that of [`tryon_geometry::camera::Intrinsics`].
pub const MAX_SIDE: u32 = 16_384;

/// Most pixels of an image: five times the largest depth-and-colour camera on sale, 200 MB as colour.
pub const MAX_PIXELS: u64 = 1 << 26;

/// Largest image file: an uncompressed 16-bit image of [`MAX_PIXELS`] with its headers.
pub(super) const MAX_FILE_BYTES: u64 = 4 * MAX_PIXELS;

/// Checks the size of an image against [`MAX_SIDE`] and [`MAX_PIXELS`].
pub(crate) fn check_size(origin: &Path, width: u32, height: u32) -> Result<(), FormatError> {
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

/// Reads a whole file of at most `limit` bytes.
pub(crate) fn read_limited(path: &Path, limit: u64) -> Result<Vec<u8>, FormatError> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_sizes_name_the_side() {
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
}
