//! Cameras of this machine, a finding a family: what is plugged in, and what is missing.

use serde::Serialize;
use tryon::inspection::Finding;
use tryon_devices::{Device, DeviceError, FamilyReport, Stream};

/// Cameras by the SDK of their maker, which is not in this program: another program feeds them.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct FedFamily {
    /// Name, for people.
    pub(crate) name: &'static str,
    /// Program of `examples/cameras` that feeds one, and the package that it needs.
    pub(crate) program: &'static str,
    /// Package of its ROS 2 driver.
    pub(crate) ros: &'static str,
}

/// All of them.
pub(crate) const FED: [FedFamily; 4] = [
    FedFamily {
        name: "realsense",
        program: "realsense.py (pip install pyrealsense2)",
        ros: "realsense2_camera",
    },
    FedFamily {
        name: "azure kinect",
        program: "k4a.py (pip install pyk4a-bundle)",
        ros: "azure_kinect_ros_driver",
    },
    FedFamily {
        name: "orbbec",
        program: "orbbec.py (pip install pyorbbecsdk2)",
        ros: "orbbec_camera",
    },
    FedFamily {
        name: "oak",
        program: "depthai.py (pip install depthai)",
        ros: "depthai_ros_driver",
    },
];

impl FedFamily {
    /// The way by which such a camera is used.
    pub(crate) fn way(&self) -> String {
        format!(
            "its SDK is not in this program: set source = \"push\" and run examples/cameras/{}, or its ROS 2 driver, {}, \
             and source = \"ros2:DEPTH,COLOR\" with its topics",
            self.program, self.ros
        )
    }
}

/// Findings of all families, those without a driver last.
pub(crate) fn findings(reports: &[FamilyReport]) -> Vec<Finding> {
    let own = reports.iter().map(finding);
    let fed = FED.iter().map(|f| Finding::good(f.name, f.way()));
    own.chain(fed).collect()
}

fn finding(report: &FamilyReport) -> Finding {
    let what = report.family.name();
    match &report.devices {
        Ok(devices) if devices.is_empty() => {
            Finding::good(what, "nothing is missing; no camera is plugged in")
        }
        Ok(devices) => {
            let told: Vec<String> = devices.iter().map(described).collect();
            Finding::good(what, told.join("; "))
        }
        Err(e) => Finding::note(what, fault(report, e)),
    }
}

/// Fault of a family without the family's name before it.
pub(crate) fn fault(report: &FamilyReport, e: &DeviceError) -> String {
    let words = e.to_string();
    let name = format!("{}: ", report.family);
    words.strip_prefix(&name).unwrap_or(&words).to_owned()
}

/// Source of a device in configurations and commands.
pub(crate) fn source(device: &Device) -> String {
    format!("{}:{}", device.family, device.serial)
}

fn described(device: &Device) -> String {
    let modes = device.modes.iter().map(|mode| {
        let stream = stream_name(mode.stream);
        format!("{stream} {}×{} at {}", mode.width, mode.height, mode.rate)
    });
    let modes: Vec<String> = modes.collect();
    let modes = if modes.is_empty() {
        "no modes told".to_owned()
    } else {
        modes.join(", ")
    };
    format!("{} ({}): {modes}", source(device), device.name)
}

/// Name of a kind of images.
pub(crate) fn stream_name(stream: Stream) -> &'static str {
    match stream {
        Stream::Depth => "depth",
        Stream::Color => "colour",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon::inspection::Rating;
    use tryon_devices::{Family, Mode};

    fn report(devices: Result<Vec<Device>, DeviceError>) -> FamilyReport {
        FamilyReport {
            family: Family::Freenect,
            devices,
        }
    }

    #[test]
    fn families_tell_their_cameras_or_what_is_missing() {
        let kinect = Device {
            family: Family::Freenect,
            serial: "A00362807917045A".into(),
            name: "Kinect for Xbox 360".into(),
            modes: vec![Mode {
                stream: Stream::Depth,
                width: 640,
                height: 480,
                rate: 30.0,
            }],
        };
        let missing = DeviceError::MissingLibrary {
            family: Family::Freenect,
            library: "libfreenect.so.0.5",
            package: "libfreenect0.5",
            why: "no such file".into(),
        };
        let reports = [
            report(Ok(vec![kinect])),
            report(Ok(vec![])),
            report(Err(missing)),
        ];
        let all = findings(&reports);
        assert_eq!(all.len(), 3 + FED.len());
        let there = "freenect:A00362807917045A (Kinect for Xbox 360): depth 640×480 at 30";
        assert_eq!(
            (all[0].verdict, all[0].detail.as_str()),
            (Rating::Good, there)
        );
        assert!(all[1].detail.contains("no camera is plugged in"));
        assert_eq!(all[2].verdict, Rating::Note);
        let words = &all[2].detail;
        assert!(words.starts_with("libfreenect.so.0.5"), "{words}");
        assert!(words.contains("apt-get install libfreenect0.5"), "{words}");
        assert!(all[3].detail.contains("examples/cameras/realsense.py"));
    }
}
