//! Frames of a sender as a source.

use super::description::Description;
use super::newest::Newest;
use super::offset::ColorOffset;
use std::path::PathBuf;
use std::sync::Arc;
use tryon_formats::image::{decode_color, yuyv_to_rgb};
use tryon_formats::{FormatError, RgbdSource, depth_to_mm};
use tryon_geometry::camera::{
    Calibration, ColorImage, DepthImage, ImageError, LensCalibration, RgbdFrame,
};
use tryon_proto::v1::{CameraFrame, ColorEncoding, FrameOutcome};

/// Frames of one call. It ends with the call.
pub(super) struct PushSource {
    /// For errors.
    name: PathBuf,
    description: Description,
    calibration: Calibration,
    newest: Arc<Newest>,
    offset: ColorOffset,
}

impl PushSource {
    pub(super) fn new(name: PathBuf, description: Description, newest: Arc<Newest>) -> Self {
        let calibration = description.lenses.pinholes();
        Self {
            name,
            description,
            calibration,
            newest,
            offset: ColorOffset::default(),
        }
    }

    fn decode(&self, frame: &CameraFrame) -> Result<RgbdFrame, FormatError> {
        let of = |field: &'static str| {
            move |e: ImageError| FormatError::field(&self.name, field, e.to_string())
        };
        let k = &self.description.lenses.depth.intrinsics;
        let pixels = frame.depth.as_chunks::<2>().0.iter();
        let values = pixels.map(|b| u16::from_le_bytes(*b)).collect();
        let mut depth = DepthImage::new(k.width, k.height, values).map_err(of("depth"))?;
        depth_to_mm(&mut depth, self.description.depth_unit.recip());
        Ok(RgbdFrame {
            sequence: frame.number,
            time_ns: frame.capture_time_ns,
            depth,
            color: self.color(frame)?,
        })
    }

    fn color(&self, frame: &CameraFrame) -> Result<Option<ColorImage>, FormatError> {
        let k = self.description.color();
        let bytes = match frame.color_encoding() {
            ColorEncoding::Unspecified => return Ok(None),
            ColorEncoding::Jpeg => return self.jpeg(&frame.color).map(Some),
            ColorEncoding::Rgb8 => frame.color.to_vec(),
            ColorEncoding::Bgr8 => {
                let pixels = frame.color.as_chunks::<3>().0.iter();
                pixels.flat_map(|[b, g, r]| [*r, *g, *b]).collect()
            }
            ColorEncoding::Yuyv => yuyv_to_rgb(&frame.color).into_flattened(),
        };
        let image = ColorImage::new(k.width, k.height, bytes);
        image
            .map(Some)
            .map_err(|e| FormatError::field(&self.name, "color", e.to_string()))
    }

    fn jpeg(&self, bytes: &[u8]) -> Result<ColorImage, FormatError> {
        let image = decode_color(bytes, &self.name)?;
        let k = self.description.color();
        let (got, want) = ((image.width(), image.height()), (k.width, k.height));
        if got == want {
            return Ok(image);
        }
        let why = format!("{got:?} pixels, but the description says {want:?}");
        Err(FormatError::field(&self.name, "color", why))
    }
}

impl RgbdSource for PushSource {
    fn calibration(&self) -> &Calibration {
        &self.calibration
    }
    fn lenses(&self) -> LensCalibration {
        self.description.lenses.clone()
    }
    fn len(&self) -> Option<usize> {
        None
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let Some(frame) = self.newest.take() else {
            return Ok(None);
        };
        self.offset.note(&self.name.to_string_lossy(), &frame);
        let decoded = self.decode(&frame);
        let (outcome, detail) = match &decoded {
            Ok(_) => (FrameOutcome::Taken, String::new()),
            Err(e) => (FrameOutcome::Refused, e.to_string()),
        };
        self.newest.answer(frame.number, outcome, detail);
        decoded.map(Some)
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        Ok(())
    }
}
