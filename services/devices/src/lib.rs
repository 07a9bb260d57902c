//! Depth cameras by the libraries of the box, found at run time: libfreenect, OpenNI2, V4L2.
//!
//! A camera is named by its family and its serial number, so that it is the same one after it was unplugged.
//! [`list`] reports each family's cameras or the lack of its library; [`open`] gives frames.
//!
//! # Ideas
//!
//! - Names: families [`mod@family`], cameras by serial number [`mod@device`], faults with their remedy [`mod@error`].
//! - Images to frames: drivers [`mod@driver`], a thread for each camera [`mod@pump`], pairs by time [`mod@pairing`], the
//!   newest wins [`mod@newest`], [`mod@decode`].
//! - Families: [`mod@freenect`], [`mod@openni`], [`mod@v4l2`]; shared libraries at run time [`mod@library`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod calibration;
mod decode;
mod device;
mod driver;
mod error;
mod family;
mod freenect;
mod library;
mod newest;
mod openni;
mod packed;
mod pairing;
mod pump;
mod source;
mod v4l2;

pub use device::{Device, DeviceOptions, FamilyReport, Mode};
pub use error::DeviceError;
pub use family::{Family, Stream};

use tryon_formats::RgbdSource;

/// Cameras of each family, or the reason why a family has none.
pub fn list() -> Vec<FamilyReport> {
    let report = |family| FamilyReport {
        family,
        devices: match family {
            Family::Freenect => freenect::list(),
            Family::Openni => openni::list(),
            Family::V4l2 => v4l2::list(),
        },
    };
    Family::ALL.map(report).into()
}

/// True for the configured source of a camera of this crate: `freenect`, `freenect:SERIAL`, `openni`, `v4l2` …
pub fn is_device(source: &str) -> bool {
    device::parse(source).is_some()
}

/// Checks that the box has what a camera's family needs; the camera itself may be unplugged.
///
/// # Errors
/// A source of no family, or a missing library.
pub fn check(source: &str) -> Result<(), DeviceError> {
    match parse(source)?.0 {
        Family::V4l2 => Ok(()),
        family => library::load(family).map(drop),
    }
}

/// Opens a camera by its source, `FAMILY` for the only one of a family or `FAMILY:SERIAL`. Frames are rectified.
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
    let (family, serial) = parse(source)?;
    pump::settle();
    let opened = match family {
        Family::Freenect => freenect::open(serial, options),
        Family::Openni => openni::open(serial, options),
        Family::V4l2 => v4l2::open(serial, options),
    };
    source::start(opened?)
}

fn parse(source: &str) -> Result<(Family, Option<&str>), DeviceError> {
    device::parse(source).ok_or_else(|| DeviceError::Source {
        source_name: source.into(),
    })
}
