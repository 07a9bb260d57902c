//! Source whose frames are set upright as they are read: of a camera that hangs turned, or delivers mirrored pictures.

use super::CameraFile;
use super::converted::{Converted, FrameConverter};
use super::rgbd_source::RgbdSource;
use std::path::Path;
use tryon_geometry::camera::{
    Calibration, FrameSizeError, LensCalibration, Mounting, Reorienter, RgbdFrame,
};

/// Source of upright frames from one that is mounted otherwise.
pub type Reoriented = Converted<Reorienter>;

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
        let reorienter = Reorienter::new(mounting, &source.lenses());
        Box::new(Self::new(path, source, reorienter))
    }
}

impl FrameConverter for Reorienter {
    fn calibration(&self) -> &Calibration {
        self.calibration()
    }
    fn lenses(&self) -> LensCalibration {
        self.lenses().clone()
    }
    fn camera_file(&self, recorded: CameraFile) -> CameraFile {
        CameraFile {
            lenses: self.lenses().clone(),
            ..recorded
        }
    }
    fn convert(&mut self, frame: &mut RgbdFrame) -> Result<(), FrameSizeError> {
        self.reorient(frame)
    }
}
