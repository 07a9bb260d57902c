//! Pixels of chosen images, decoded and checked against their cameras.

use super::fault::MessageFault;
use super::topic_images::TimedImage;
use crate::FormatError;
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, LensCalibration};

/// Decoder of the depth and colour images of one camera, of a file or live.
#[derive(Clone, Debug)]
pub(super) struct FrameDecoder {
    /// Named in errors.
    origin: PathBuf,
    calibration: Calibration,
    lenses: LensCalibration,
    /// Metres of a unit of 16-bit depth.
    depth_unit: f64,
}

impl FrameDecoder {
    pub(super) fn new(origin: &Path, lenses: LensCalibration, depth_unit: f64) -> Self {
        Self {
            origin: origin.to_owned(),
            calibration: lenses.pinholes(),
            lenses,
            depth_unit,
        }
    }

    /// File or source, named in errors.
    pub(super) fn origin(&self) -> &Path {
        &self.origin
    }
    pub(super) fn calibration(&self) -> &Calibration {
        &self.calibration
    }
    /// Calibration with the distortion that the images have.
    pub(super) fn lenses(&self) -> LensCalibration {
        self.lenses.clone()
    }

    /// Depth, millimetres.
    ///
    /// # Errors
    /// Names the message and its field: an encoding that is no depth, missing bytes, or another size than the camera's.
    pub(super) fn depth(&self, image: &TimedImage) -> Result<DepthImage, FormatError> {
        let fault = |f: MessageFault| image.head.error(&self.origin, f);
        let depth = image.image.depth(self.depth_unit).map_err(fault)?;
        let size = (depth.width(), depth.height());
        check_camera("depth size", size, &self.calibration.depth).map_err(fault)?;
        Ok(depth)
    }

    /// Colour, 8-bit RGB.
    ///
    /// # Errors
    /// As [`Self::depth`].
    pub(super) fn color(&self, image: &TimedImage) -> Result<ColorImage, FormatError> {
        let fault = |f: MessageFault| image.head.error(&self.origin, f);
        let color = image.image.color().map_err(fault)?;
        let camera = self.calibration.color.unwrap_or(self.calibration.depth);
        let size = (color.width(), color.height());
        check_camera("color size", size, &camera).map_err(fault)?;
        Ok(color)
    }
}

/// Checks the size of an image against its camera.
fn check_camera(field: &str, size: (u32, u32), camera: &Intrinsics) -> Result<(), MessageFault> {
    if size == (camera.width, camera.height) {
        return Ok(());
    }
    let (width, height) = size;
    let why = format!(
        "{width}×{height}, but the calibration says {}×{}",
        camera.width, camera.height
    );
    Err(MessageFault::new(field, why))
}
