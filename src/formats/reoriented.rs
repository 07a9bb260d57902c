//! Source whose frames are set upright as they are read: of a camera that hangs turned, or delivers mirrored pictures.

use super::rgbd_source::RgbdSource;
use super::{CameraFile, FormatError};
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{Calibration, LensCalibration, Mounting, Reorienter, RgbdFrame};

/// Source of upright frames from one that is mounted otherwise.
pub struct Reoriented {
    path: PathBuf,
    source: Box<dyn RgbdSource>,
    reorienter: Reorienter,
}

impl Reoriented {
    /// Wraps `source` unless it is upright; `path` is named in errors.
    pub fn wrap(
        path: &Path,
        source: Box<dyn RgbdSource>,
        mounting: Mounting,
    ) -> Box<dyn RgbdSource> {
        if mounting.is_upright() {
            return source;
        }
        Box::new(Self {
            path: path.to_owned(),
            reorienter: Reorienter::new(mounting, &source.lenses()),
            source,
        })
    }
}

impl RgbdSource for Reoriented {
    fn calibration(&self) -> &Calibration {
        self.reorienter.calibration()
    }
    fn lenses(&self) -> LensCalibration {
        self.reorienter.lenses().clone()
    }
    fn camera_file(&self) -> CameraFile {
        CameraFile {
            lenses: self.lenses(),
            ..self.source.camera_file()
        }
    }
    fn color_time_ns(&self) -> Option<u64> {
        self.source.color_time_ns()
    }
    fn untaken(&self) -> &[String] {
        self.source.untaken()
    }
    fn len(&self) -> Option<usize> {
        self.source.len()
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let Some(mut frame) = self.source.next_frame()? else {
            return Ok(None);
        };
        let converted = self.reorienter.reorient(&mut frame);
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
