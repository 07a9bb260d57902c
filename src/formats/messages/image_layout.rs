//! Form of an image's bytes and kind of its pixels.

/// Form of an image's bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum ImageLayout {
    /// Rows of pixels.
    Raw {
        width: u32,
        height: u32,
        /// Name of the pixel format, as in `sensor_msgs/image_encodings`.
        encoding: String,
        is_big_endian: bool,
        /// Bytes from row to row.
        step: u32,
    },
    /// An image file.
    Compressed {
        /// `jpeg`, `png`, `rgb8; jpeg compressed bgr8`, `16UC1; compressedDepth png`.
        format: String,
    },
}

/// Kind of the values of an image's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PixelContent {
    /// Depth: `16UC1` or `32FC1`.
    Depth,
    /// 16-bit grey, `mono16`: depth of some drivers, infrared of others.
    Grey16,
    /// Colour.
    Color,
    /// 8-bit grey.
    Grey,
    /// An encoding that is not read.
    Unread,
}

/// Metres to millimetres; values that 16 bits cannot hold, NaN and those at or below zero become 0, "no reading".
pub(super) fn millimetres(metres: f64) -> u16 {
    const MM: f64 = 1000.0;
    let mm = (metres * MM).round();
    if mm > 0.0 && mm <= f64::from(u16::MAX) {
        mm as u16
    } else {
        0
    }
}
