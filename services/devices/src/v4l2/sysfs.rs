//! Video nodes of USB cameras by /sys: which nodes are of one camera, its model and serial number.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A USB camera with its video nodes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct UsbCamera {
    /// Serial number; of a camera that states none, its place on the bus as `BUS-PORT.PORT`.
    pub(super) serial: String,
    /// Model.
    pub(super) name: String,
    /// Names of its nodes, `video0` …, in order of their numbers.
    pub(super) nodes: Vec<String>,
}

/// Cameras of `/sys/class/video4linux`, or of a folder like it.
///
/// # Errors
/// When the folder cannot be read: the kernel has no video nodes.
pub(super) fn cameras(class: &Path) -> io::Result<Vec<UsbCamera>> {
    let mut found: BTreeMap<PathBuf, Vec<(u32, String)>> = BTreeMap::new();
    for entry in fs::read_dir(class)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        let number = name.strip_prefix("video").and_then(|n| n.parse().ok());
        let usb = fs::canonicalize(class.join(&name).join("device"))
            .ok()
            .and_then(|d| usb_device(&d));
        // Nodes of other buses, and those that were unplugged meanwhile, have none.
        if let (Some(number), Some(usb)) = (number, usb) {
            found.entry(usb).or_default().push((number, name));
        }
    }
    Ok(found
        .into_iter()
        .map(|(usb, nodes)| camera(&usb, nodes))
        .collect())
}

/// The USB device above an interface: the nearest folder with an `idVendor`.
fn usb_device(interface: &Path) -> Option<PathBuf> {
    let above = interface.ancestors().take(4);
    let mut devices = above.filter(|p| p.join("idVendor").is_file());
    devices.next().map(Path::to_path_buf)
}

fn camera(usb: &Path, mut nodes: Vec<(u32, String)>) -> UsbCamera {
    nodes.sort_unstable();
    let read = |file: &str| {
        let text = fs::read_to_string(usb.join(file)).unwrap_or_default();
        Some(text.trim().to_owned()).filter(|t| !t.is_empty())
    };
    let place = usb.file_name().unwrap_or_default().to_string_lossy();
    UsbCamera {
        serial: read("serial").unwrap_or_else(|| place.into_owned()),
        name: read("product").unwrap_or_else(|| "USB camera".into()),
        nodes: nodes.into_iter().map(|(_, name)| name).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    /// As the kernel lays it out: `class/videoN/device` links to the USB interface.
    fn plug(root: &Path, usb: &str, serial: Option<&str>, nodes: &[(u32, u32)]) {
        let device = root.join("devices/pci0000:00/usb2").join(usb);
        fs::create_dir_all(&device).expect("made");
        let write = |file: &str, text: &str| fs::write(device.join(file), text).expect("written");
        write("idVendor", "8086\n");
        write("product", "Intel(R) RealSense(TM) Depth Camera 435\n");
        if let Some(serial) = serial {
            write("serial", &format!("{serial}\n"));
        }
        for (interface, number) in nodes {
            let interface = device.join(format!("{usb}:1.{interface}"));
            let node = interface.join(format!("video4linux/video{number}"));
            fs::create_dir_all(&node).expect("made");
            symlink(&interface, node.join("device")).expect("linked");
            symlink(&node, root.join("class").join(format!("video{number}"))).expect("linked");
        }
    }

    #[test]
    fn nodes_of_one_usb_device_are_one_camera() {
        let root = tempfile::tempdir().expect("a folder");
        let class = root.path().join("class");
        fs::create_dir(&class).expect("made");
        assert_eq!(cameras(&class).expect("empty"), []);
        plug(
            root.path(),
            "2-1.4",
            Some("035422073153"),
            &[(3, 10), (0, 2), (0, 3)],
        );
        plug(root.path(), "2-2", None, &[(0, 0)]);
        // A node of no USB device: a sensor on the board.
        fs::create_dir_all(class.join("video9/device")).expect("made");
        fs::create_dir_all(class.join("v4l-subdev0")).expect("made");
        let found = cameras(&class).expect("listed");
        let found: Vec<_> = found
            .iter()
            .map(|c| (c.serial.as_str(), c.nodes.join(" ")))
            .collect();
        assert_eq!(
            found,
            [
                ("035422073153", "video2 video3 video10".to_owned()),
                ("2-2", "video0".to_owned())
            ]
        );
        assert!(cameras(&root.path().join("none")).is_err());
    }
}
