//! Faults of cameras, each with its remedy.

use super::Family;

/// A camera that cannot be listed, opened or read.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// The box lacks the family's library.
    #[error("{family}: {library} is not installed ({why}); install it: apt-get install {package}")]
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
    /// No camera with the serial number is plugged in.
    #[error("{family}:{serial}: not plugged in; {present}")]
    Absent {
        /// The family.
        family: Family,
        /// Serial number asked for; `*` for any.
        serial: String,
        /// Serial numbers that are there, as a sentence.
        present: String,
    },
    /// The driver refuses, or frames stop.
    #[error("{family}:{serial}: `{field}`: {why}")]
    Driver {
        /// The family.
        family: Family,
        /// Serial number of the camera; `*` for the whole family.
        serial: String,
        /// Call or stream at fault.
        field: &'static str,
        /// The fault.
        why: String,
    },
}

impl DeviceError {
    /// The family's library is missing.
    pub(crate) fn missing(family: Family, why: String) -> Self {
        let (library, package) = match family {
            Family::Freenect => ("libfreenect.so.0.5", "libfreenect0.5"),
            Family::Openni => ("libOpenNI2.so.0", "libopenni2-0"),
            Family::V4l2 => ("/dev/video*", "linux-image-amd64"),
        };
        Self::MissingLibrary {
            family,
            library,
            package,
            why,
        }
    }
}
