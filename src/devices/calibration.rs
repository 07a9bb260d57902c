//! Calibration that whoever opens a camera gives it.

use super::{DeviceError, DeviceOptions};
use tryon_formats::CameraFile;

/// The given `camera.json`, if any; `camera` is named in errors.
///
/// # Errors
/// An unreadable file, or a field of it at fault.
pub(crate) fn given(
    camera: &str,
    options: &DeviceOptions,
) -> Result<Option<CameraFile>, DeviceError> {
    let Some(path) = &options.camera else {
        return Ok(None);
    };
    let read = CameraFile::read(path);
    read.map(Some)
        .map_err(|e| DeviceError::calibration(camera, e.to_string()))
}
