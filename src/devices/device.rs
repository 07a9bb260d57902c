//! Names of cameras: family, serial number, modes.

use super::DeviceError;
use std::fmt;
use std::path::PathBuf;

/// Library that drives a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// Kinect v1 by libfreenect.
    Freenect,
    /// PrimeSense, Xtion and Astra by OpenNI 2.
    Openni,
    /// RealSense by Video4Linux.
    V4l2,
}

impl Family {
    /// All of them, in the order of reports.
    pub const ALL: [Self; 3] = [Self::Freenect, Self::Openni, Self::V4l2];

    /// Name in a source: `freenect`, `openni` or `v4l2`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Freenect => "freenect",
            Self::Openni => "openni",
            Self::V4l2 => "v4l2",
        }
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Kind of images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// Depth.
    Depth,
    /// Colour.
    Color,
}

/// Image size and rate that a camera offers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Kind of images.
    pub stream: Stream,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Frames a second.
    pub rate: f64,
}

/// A camera that is plugged in.
#[derive(Clone, Debug, PartialEq)]
pub struct Device {
    /// Library that drives it.
    pub family: Family,
    /// Serial number; where a camera tells none, the place it is plugged in.
    pub serial: String,
    /// Model, for people.
    pub name: String,
    /// Sizes and rates of its images.
    pub modes: Vec<Mode>,
}

/// Cameras of a family.
#[derive(Debug)]
pub struct FamilyReport {
    /// The family.
    pub family: Family,
    /// Its cameras, or the reason why they cannot be listed.
    pub devices: Result<Vec<Device>, DeviceError>,
}

/// Choices of whoever opens a camera.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeviceOptions {
    /// A `camera.json` in place of the camera's own calibration; cameras by `v4l2` tell none and need it.
    pub camera: Option<PathBuf>,
}

/// Family and serial number of a source; without a serial number, the only camera of the family.
pub(crate) fn parse(source: &str) -> Option<(Family, Option<&str>)> {
    let (name, serial) = match source.split_once(':') {
        Some((name, serial)) if !serial.is_empty() => (name, Some(serial)),
        Some(_) => return None,
        None => (source, None),
    };
    let family = Family::ALL.into_iter().find(|f| f.name() == name)?;
    Some((family, serial))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_name_a_family_and_perhaps_a_serial_number() {
        let of = |source| parse(source).map(|(family, serial)| (family.name(), serial));
        assert_eq!(of("freenect"), Some(("freenect", None)));
        assert_eq!(of("openni:A:1"), Some(("openni", Some("A:1"))));
        assert_eq!(of("v4l2:0042"), Some(("v4l2", Some("0042"))));
        for other in [
            "",
            "freenect:",
            "freenect2",
            "Freenect",
            "push",
            "/dev/video0",
            "ros2:/a,/b",
        ] {
            assert_eq!(of(other), None, "{other}");
        }
    }
}
