//! Image of a message: its layout, and depth or colour decoded from it.

use super::fault::MessageFault;
use super::image_layout::{ImageLayout, PixelContent};
use super::{compressed, raw_pixels};
use std::borrow::Cow;
use tryon_geometry::camera::{ColorImage, DepthImage};

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
