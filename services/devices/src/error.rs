//! Faults of cameras, each with its remedy.

use super::{Family, Stream};
use std::path::Path;
use tryon_formats::FormatError;

/// A camera that cannot be listed, opened or read.
#[derive(Clone, Debug, thiserror::Error)]
pub enum DeviceError {
    /// The box lacks the family's library, or it is none of the expected version.
    #[error("{family}: {library} cannot be used ({why}); remedy: apt-get install {package}")]
    MissingLibrary {
        /// The family.
        family: Family,
        /// File name of the library.
        library: &'static str,
        /// Debian package that has it.
        package: &'static str,
        /// Answer of the loader.
        why: String,
    },
    /// A source that names no family.
    #[error("{source_name}: no camera of this name; families are freenect, openni and v4l2")]
    Source {
        /// As configured.
        source_name: String,
    },
    /// No camera with the serial number is plugged in, or several without one asked for.
    #[error("{camera}: {why}; {}", present_cameras(present))]
    Absent {
        /// `FAMILY:SERIAL`, or `FAMILY` for any.
        camera: String,
        /// Not plugged in, or one of several.
        why: &'static str,
        /// Serial numbers that are there.
        present: Vec<String>,
    },
    /// A camera whose calibration is not known.
    #[error("{camera}: `camera`: {why}")]
    Calibration {
        /// `FAMILY:SERIAL`.
        camera: String,
        /// The fault and the way around.
        why: String,
    },
    /// The driver refuses, or the camera has gone.
    #[error("{camera}: `{field}`: {why}")]
    Driver {
        /// `FAMILY:SERIAL`, or `FAMILY` for the driver itself.
        camera: String,
        /// Call or stream at fault.
        field: &'static str,
        /// The fault.
        why: String,
    },
}

fn present_cameras(serials: &[String]) -> String {
    if serials.is_empty() {
        "no camera of this family is plugged in".into()
    } else {
        format!("plugged in: {}", serials.join(", "))
    }
}

impl DeviceError {
    /// The family's library is missing.
    pub(crate) fn missing(family: Family, why: String) -> Self {
        let (library, package) = family.library();
        Self::MissingLibrary {
            family,
            library,
            package,
            why,
        }
    }

    /// A refusal of a driver.
    pub(crate) fn driver(
        camera: impl ToString,
        field: &'static str,
        why: impl Into<String>,
    ) -> Self {
        Self::Driver {
            camera: camera.to_string(),
            field,
            why: why.into(),
        }
    }

    /// A camera without a usable calibration.
    pub(crate) fn calibration(camera: impl ToString, why: impl Into<String>) -> Self {
        Self::Calibration {
            camera: camera.to_string(),
            why: why.into(),
        }
    }

    /// Images of a stream stay away.
    pub(crate) fn silent(
        camera: impl ToString,
        stream: Stream,
        after: std::time::Duration,
    ) -> Self {
        let why = format!(
            "no image for {:.1} s: has it been unplugged?",
            after.as_secs_f64()
        );
        Self::driver(camera, stream.name(), why)
    }
}

impl From<DeviceError> for FormatError {
    fn from(e: DeviceError) -> Self {
        let text = e.to_string();
        match e {
            DeviceError::Driver { camera, field, why } => {
                Self::field(Path::new(&camera), field, why)
            }
            _ => Self::field(Path::new("camera"), "source", text),
        }
    }
}
