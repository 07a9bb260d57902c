//! Image of a message: its layout, and depth or colour decoded from it.

use super::fault::MessageFault;
use super::{compressed, raw_pixels};
use std::borrow::Cow;
use tryon_geometry::camera::{ColorImage, DepthImage};

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

/// Image of a message.
#[derive(Clone, Debug)]
pub(crate) struct ImageMessage<'a> {
    /// Frame of reference of its camera.
    pub(super) frame_id: String,
    /// Capture time, nanoseconds.
    pub(super) stamp_ns: Option<u64>,
    /// Number within its topic, where the schema has one.
    pub(super) sequence: Option<u32>,
    pub(super) layout: ImageLayout,
    /// Metres of a unit of 16-bit depth, if the message states it.
    pub(super) depth_unit: Option<f64>,
    pub(super) data: Cow<'a, [u8]>,
}

impl ImageMessage<'_> {
    /// Kind of the pixels, by encoding or format.
    pub(super) fn content(&self) -> PixelContent {
        match &self.layout {
            ImageLayout::Raw { encoding, .. } => raw_pixels::content(encoding),
            ImageLayout::Compressed { format } => compressed::content(format, &self.data),
        }
    }
    /// Encoding or format, as the message writes it.
    pub(super) fn encoding(&self) -> &str {
        match &self.layout {
            ImageLayout::Raw { encoding, .. } => encoding,
            ImageLayout::Compressed { format } => format,
        }
    }
    /// Width and height; `None` for image files.
    pub(super) fn size(&self) -> Option<(u32, u32)> {
        match self.layout {
            ImageLayout::Raw { width, height, .. } => Some((width, height)),
            ImageLayout::Compressed { .. } => None,
        }
    }

    /// Depth in millimetres, 0 = no reading. `unit` \[m\] scales 16-bit values.
    ///
    /// # Errors
    /// An encoding that is no depth, or missing bytes.
    pub(super) fn depth(&self, unit: f64) -> Result<DepthImage, MessageFault> {
        match &self.layout {
            ImageLayout::Raw { .. } => raw_pixels::depth(&self.layout, &self.data, unit),
            ImageLayout::Compressed { format } => compressed::depth(format, &self.data, unit),
        }
    }
    /// Colour, 8-bit RGB.
    ///
    /// # Errors
    /// An encoding that is no colour, or missing bytes.
    pub(super) fn color(&self) -> Result<ColorImage, MessageFault> {
        match &self.layout {
            ImageLayout::Raw { .. } => raw_pixels::color(&self.layout, &self.data),
            ImageLayout::Compressed { format } => compressed::color(format, &self.data),
        }
    }

    /// The same image with bytes of its own.
    pub(super) fn into_owned(self) -> ImageMessage<'static> {
        ImageMessage {
            data: Cow::Owned(self.data.into_owned()),
            frame_id: self.frame_id,
            stamp_ns: self.stamp_ns,
            sequence: self.sequence,
            layout: self.layout,
            depth_unit: self.depth_unit,
        }
    }
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
