//! Cameras by serial number: what a source names, what is plugged in.

use super::{DeviceError, Family, Stream};
use std::path::PathBuf;

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
    /// Serial number; of a camera that states none, its place on the bus.
    pub serial: String,
    /// Model, for people.
    pub name: String,
    /// Sizes and rates of its images.
    pub modes: Vec<Mode>,
}

/// Cameras of a family.
#[derive(Clone, Debug)]
pub struct FamilyReport {
    /// The family.
    pub family: Family,
    /// Its cameras, or the reason why they cannot be listed.
    pub devices: Result<Vec<Device>, DeviceError>,
}

/// Choices of whoever opens a camera.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeviceOptions {
    /// A `camera.json` in place of the camera's own calibration. Cameras by `v4l2` state none and need it.
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

/// Source of one camera, `FAMILY:SERIAL`.
pub(crate) fn source_name(family: Family, serial: &str) -> String {
    format!("{family}:{serial}")
}

/// Serial number to open among those present: the one asked for, or the only one.
///
/// # Errors
/// None of that number, none at all, or several without one asked for.
pub(crate) fn choose(
    family: Family,
    serial: Option<&str>,
    present: &[String],
) -> Result<String, DeviceError> {
    let fault = |camera: String, why| DeviceError::Absent {
        camera,
        why,
        present: present.to_vec(),
    };
    match (serial, present) {
        (Some(s), _) if present.iter().any(|p| p == s) => Ok(s.to_owned()),
        (Some(s), _) => Err(fault(source_name(family, s), "not plugged in")),
        (None, [only]) => Ok(only.clone()),
        (None, []) => Err(fault(family.to_string(), "not plugged in")),
        (None, _) => Err(fault(family.to_string(), "choose one by its serial number")),
    }
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
        let others = [
            "",
            "freenect:",
            "freenect2",
            "Freenect",
            "push",
            "/dev/video0",
            "ros2:/a,/b",
        ];
        for other in others {
            assert_eq!(of(other), None, "{other}");
        }
    }

    #[test]
    fn a_camera_is_chosen_by_its_number_and_faults_list_those_present() {
        let two = ["A1".to_owned(), "B2".to_owned()];
        let of = |serial, present: &[String]| {
            choose(Family::Openni, serial, present).map_err(|e| e.to_string())
        };
        assert_eq!(of(Some("B2"), &two), Ok("B2".into()));
        assert_eq!(of(None, &two[..1]), Ok("A1".into()));
        let fault = of(Some("C3"), &two).expect_err("absent");
        assert_eq!(fault, "openni:C3: not plugged in; plugged in: A1, B2");
        let fault = of(None, &two).expect_err("two");
        assert_eq!(
            fault,
            "openni: choose one by its serial number; plugged in: A1, B2"
        );
        let fault = of(None, &[]).expect_err("none");
        assert_eq!(
            fault,
            "openni: not plugged in; no camera of this family is plugged in"
        );
    }
}
