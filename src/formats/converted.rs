//! Source whose frames are converted as they are read.

use super::rgbd_source::RgbdSource;
use super::{CameraFile, FormatError};
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{Calibration, FrameSizeError, LensCalibration, RgbdFrame};

/// Conversion of the frames of a source, and the cameras that they have then.
pub trait FrameConverter: Send {
    /// Calibration of the converted frames.
    fn calibration(&self) -> &Calibration;
    /// The same with the distortion that the converted frames still have.
    fn lenses(&self) -> LensCalibration {
        self.calibration().clone().into()
    }
    /// Calibration as recorded, of the converted frames.
    fn camera_file(&self, recorded: CameraFile) -> CameraFile {
        recorded
    }
    /// Converts a frame in place.
    ///
    /// # Errors
    /// An image that has not the size of its camera.
    fn convert(&mut self, frame: &mut RgbdFrame) -> Result<(), FrameSizeError>;
}

/// Source of frames that another source delivers, converted.
pub struct Converted<C> {
    path: PathBuf,
    source: Box<dyn RgbdSource>,
    converter: C,
}

impl<C: FrameConverter> Converted<C> {
    /// Converts the frames of `source`; `path` is named in errors.
    pub(crate) fn new(path: &Path, source: Box<dyn RgbdSource>, converter: C) -> Self {
        Self {
            path: path.to_owned(),
            source,
            converter,
        }
    }
}

impl<C: FrameConverter> RgbdSource for Converted<C> {
    fn calibration(&self) -> &Calibration {
        self.converter.calibration()
    }
    fn lenses(&self) -> LensCalibration {
        self.converter.lenses()
    }
    fn camera_file(&self) -> CameraFile {
        self.converter.camera_file(self.source.camera_file())
    }
    fn untaken(&self) -> &[String] {
        self.source.untaken()
    }
    fn color_time_ns(&self) -> Option<u64> {
        self.source.color_time_ns()
    }
    fn len(&self) -> Option<usize> {
        self.source.len()
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let Some(mut frame) = self.source.next_frame()? else {
            return Ok(None);
        };
        let converted = self.converter.convert(&mut frame);
        converted.map_err(|e| FormatError::frame(&self.path, frame.sequence, e))?;
        Ok(Some(frame))
    }
    fn skip_frame(&mut self) -> Result<bool, FormatError> {
        self.source.skip_frame()
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.source.rewind()
    }
}
