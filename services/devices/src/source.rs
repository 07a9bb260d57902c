//! Frames of an opened camera.

use super::DeviceError;
use super::decode::{decode_color_image, decode_depth_image};
use super::driver::{Formats, Opened};
use super::pump::Pump;
use std::path::PathBuf;
use tryon_formats::{FormatError, Rectified, RgbdSource};
use tryon_geometry::camera::{Calibration, LensCalibration, RgbdFrame};

/// Source of a camera's frames, lens distortion included.
struct DeviceSource {
    /// `FAMILY:SERIAL`, as a path for errors.
    name: PathBuf,
    lenses: LensCalibration,
    calibration: Calibration,
    formats: Formats,
    depth_scale: f64,
    pump: Pump,
}

/// Starts a camera: rectified frames, the newest at each call.
///
/// # Errors
/// When the system gives no thread.
pub(crate) fn start(opened: Opened) -> Result<Box<dyn RgbdSource>, DeviceError> {
    let Opened {
        name,
        driver,
        formats,
        lenses,
        depth_scale,
    } = opened;
    let pump = Pump::start(&name, driver, &formats)?;
    let path = PathBuf::from(name);
    let source = DeviceSource {
        name: path.clone(),
        calibration: lenses.pinholes(),
        lenses,
        formats,
        depth_scale,
        pump,
    };
    Ok(Rectified::wrap(&path, Box::new(source)))
}

impl RgbdSource for DeviceSource {
    fn calibration(&self) -> &Calibration {
        &self.calibration
    }
    fn lenses(&self) -> LensCalibration {
        self.lenses.clone()
    }
    fn len(&self) -> Option<usize> {
        None
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let pair = self.pump.newest.take()?;
        let depth = &pair.depth;
        let color = match (&pair.color, &self.formats.color) {
            (Some(image), Some(format)) => {
                Some(decode_color_image(&image.bytes, format, &self.name)?)
            }
            _ => None,
        };
        Ok(Some(RgbdFrame {
            sequence: pair.number,
            time_ns: depth.time_ns,
            depth: decode_depth_image(
                &depth.bytes,
                &self.formats.depth,
                self.depth_scale,
                &self.name,
            )?,
            color,
        }))
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        Ok(())
    }
}
