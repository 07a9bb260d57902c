//! Messages of an MCAP recording: depth, colour, calibration and transforms.

use crate::FormatError;
use crate::foxglove::{
    CameraCalibration, CompressedImage, FoxgloveMessage, FrameTransform, RawImage, decode,
};
use crate::image::{check_size, decode_color};
use std::path::Path;
use tryon_geometry::camera::{ColorImage, DepthImage, ImageError};

/// Content of a message that matters to RGBD frames.
pub(super) enum MessageItem {
    Depth {
        frame_id: String,
        sequence: u32,
        time_ns: u64,
        image: DepthImage,
    },
    Color {
        frame_id: String,
        time_ns: u64,
        image: ColorImage,
    },
    Calibration(CameraCalibration),
    Transform(FrameTransform),
}

/// Schema and location of a message, for errors.
pub(super) struct MessageContext<'a> {
    pub(super) path: &'a Path,
    pub(super) schema: &'a str,
    /// Number of the message in the file, from one.
    pub(super) message: u64,
}

impl MessageContext<'_> {
    fn fault(&self, field: &str, why: impl Into<String>) -> FormatError {
        FormatError::field(
            self.path,
            format!("message {} ({}).{field}", self.message, self.schema),
            why,
        )
    }
    fn message<M: FoxgloveMessage>(&self, data: &[u8]) -> Result<M, FormatError> {
        decode(data).ok_or_else(|| self.fault("data", "not a message of this schema"))
    }

    /// Decodes a message; `None` for schemas and encodings of no interest.
    pub(super) fn item(
        &self,
        sequence: u32,
        time_ns: u64,
        data: &[u8],
    ) -> Result<Option<MessageItem>, FormatError> {
        Ok(match self.schema {
            "foxglove.RawImage" => self.raw_image(self.message(data)?, sequence, time_ns)?,
            "foxglove.CompressedImage" => {
                let m: CompressedImage = self.message(data)?;
                if !matches!(m.format.as_str(), "jpeg" | "png") {
                    return Ok(None);
                }
                let image = decode_color(&m.data, self.path)
                    .map_err(|e| self.fault("data", e.to_string()))?;
                Some(MessageItem::Color {
                    frame_id: m.frame_id,
                    time_ns,
                    image,
                })
            }
            "foxglove.CameraCalibration" => Some(MessageItem::Calibration(self.message(data)?)),
            "foxglove.FrameTransform" => Some(MessageItem::Transform(self.message(data)?)),
            _ => None,
        })
    }

    fn raw_image(
        &self,
        m: RawImage,
        sequence: u32,
        time_ns: u64,
    ) -> Result<Option<MessageItem>, FormatError> {
        let fault = |e: ImageError| self.fault("data", e.to_string());
        match m.encoding.as_str() {
            "16UC1" | "mono16" => {
                let pixels = self.rows(&m, 2)?.flat_map(|r| r.as_chunks::<2>().0);
                let values = pixels.map(|b| u16::from_le_bytes(*b)).collect();
                Ok(Some(MessageItem::Depth {
                    image: DepthImage::new(m.width, m.height, values).map_err(fault)?,
                    frame_id: m.frame_id,
                    sequence,
                    time_ns,
                }))
            }
            "rgb8" => {
                let bytes = self.rows(&m, 3)?.flatten().copied().collect();
                Ok(Some(MessageItem::Color {
                    image: ColorImage::new(m.width, m.height, bytes).map_err(fault)?,
                    frame_id: m.frame_id,
                    time_ns,
                }))
            }
            _ => Ok(None),
        }
    }

    /// Bytes of each row, checked against size and step.
    fn rows<'m>(
        &self,
        m: &'m RawImage,
        bytes: usize,
    ) -> Result<impl Iterator<Item = &'m [u8]>, FormatError> {
        check_size(self.path, m.width, m.height)?;
        let (row, step) = (m.width as usize * bytes, m.step as usize);
        if step < row {
            return Err(self.fault("step", format!("{step}, a row has {row} bytes")));
        }
        let need = step * (m.height as usize - 1) + row;
        if m.data.len() < need {
            return Err(self.fault("data", format!("{} bytes, expected {need}", m.data.len())));
        }
        Ok(m.data
            .chunks(step)
            .take(m.height as usize)
            .map(move |r| &r[..row]))
    }
}
