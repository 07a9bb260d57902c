//! Calibration that whoever opens a camera gives it.

use super::driver::{Formats, StreamFormat};
use super::{DeviceError, DeviceOptions};
use tryon_formats::CameraFile;
use tryon_geometry::camera::{Intrinsics, LensCalibration};

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

/// Compares image sizes with those of the calibration; `camera` is named in errors.
///
/// # Errors
/// Names the stream and both sizes.
pub(crate) fn check_sizes(
    name: &str,
    formats: &Formats,
    lenses: &LensCalibration,
) -> Result<(), DeviceError> {
    let check = |stream: &str, format: &StreamFormat, k: &Intrinsics| {
        if (format.width, format.height) == (k.width, k.height) {
            return Ok(());
        }
        let (got, want) = ((format.width, format.height), (k.width, k.height));
        let why = format!("{stream} images have {got:?} pixels, the calibration {want:?}");
        Err(DeviceError::calibration(name, why))
    };
    check("depth", &formats.depth, &lenses.depth.intrinsics)?;
    match &formats.color {
        // Without a lens of its own colour is registered to depth.
        Some(color) => check(
            "color",
            color,
            &lenses.color.unwrap_or(lenses.depth).intrinsics,
        ),
        None => Ok(()),
    }
}
