//! Recordings by their path: a folder, or a file by its extension.

use super::bag_file::BagMessages;
use super::mcap_file::McapMessages;
use super::messages::{MessageSource, OpenContainer, StreamOptions};
use super::rectified::Rectified;
use super::rgbd_source::RgbdSource;
use super::rosbag2::{self, SqliteMessages};
use super::{FormatError, K4aReader, NpzReader, R3dReader, RgbdFolder};
use std::path::{Path, PathBuf};

/// Choices that a recording leaves to its reader.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordingOptions {
    /// Topic of depth, where a file has several.
    pub depth_topic: Option<String>,
    /// Topic of colour.
    pub color_topic: Option<String>,
    /// A `camera.json` for recordings without a calibration of their own.
    pub camera: Option<PathBuf>,
}

impl RecordingOptions {
    /// Choices for recordings of messages.
    fn streams(&self) -> StreamOptions<'_> {
        StreamOptions {
            depth_topic: self.depth_topic.as_deref(),
            color_topic: self.color_topic.as_deref(),
            camera: self.camera.as_deref(),
        }
    }
}

/// Extensions of the files that [`open_recording`] reads.
pub const RECORDING_EXTENSIONS: [&str; 7] = ["mcap", "bag", "db3", "mkv", "npz", "r3d", "png"];

/// Way around OpenNI's recordings, whose depth is in codecs of their own.
const NO_ONI: &str = "OpenNI's .oni is not read: play it with OpenNI 2 (in Python, openni2.Device.open_file), save its \
    frames as depth/N.png (16-bit millimetres) and rgb/N.png beside a camera.json, and pass that folder";

/// Opens a recording: an RGBD folder, a rosbag2 folder, or a file ending in `.mcap`, `.bag`, `.db3`, `.mkv` (Azure
/// Kinect), `.npz`, `.r3d` (Record3D) or `.png` (one depth image).
///
/// # Errors
/// No such file or folder, none of these, or an unusable calibration.
pub fn open_recording(path: &Path) -> Result<Box<dyn RgbdSource>, FormatError> {
    open_recording_with(path, &RecordingOptions::default())
}

/// As [`open_recording`], with choices. Frames of lenses with distortion are rectified.
///
/// # Errors
/// As [`open_recording`], and a topic that the recording lacks.
pub fn open_recording_with(
    path: &Path,
    options: &RecordingOptions,
) -> Result<Box<dyn RgbdSource>, FormatError> {
    Ok(Rectified::wrap(path, open_as_recorded_with(path, options)?))
}

/// As [`open_recording`], lens distortion included.
#[cfg(test)]
pub(crate) fn open_as_recorded(path: &Path) -> Result<Box<dyn RgbdSource>, FormatError> {
    open_as_recorded_with(path, &RecordingOptions::default())
}

/// As [`open_recording_with`], lens distortion included.
pub(crate) fn open_as_recorded_with(
    path: &Path,
    options: &RecordingOptions,
) -> Result<Box<dyn RgbdSource>, FormatError> {
    let kind = std::fs::metadata(path).map_err(|e| FormatError::io(path, e))?;
    let camera = options.camera.as_deref();
    let messages = |open: OpenContainer| -> Result<Box<dyn RgbdSource>, FormatError> {
        Ok(Box::new(MessageSource::open(
            path,
            open,
            options.streams(),
        )?))
    };
    if kind.is_dir() {
        return if rosbag2::is_folder(path) {
            messages(rosbag2::open_folder)
        } else {
            Ok(Box::new(RgbdFolder::open_with(path, camera)?))
        };
    }
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    match extension.to_str() {
        Some("mcap") => messages(McapMessages::open),
        Some("bag") => messages(BagMessages::open),
        Some("db3") => messages(SqliteMessages::open),
        Some("mkv") => Ok(Box::new(K4aReader::open_with(path, camera)?)),
        Some("npz") => Ok(Box::new(NpzReader::open(path, camera)?)),
        Some("r3d") => Ok(Box::new(R3dReader::open_with(path, camera)?)),
        Some("png") => Ok(Box::new(RgbdFolder::open_pair(path, camera)?)),
        Some("oni") => Err(FormatError::field(path, "recording", NO_ONI)),
        _ => {
            let known = RECORDING_EXTENSIONS.map(|e| format!(".{e}")).join(", ");
            let why = format!(
                "expected a folder with camera.json or metadata.yaml, or a file ending in {known}"
            );
            Err(FormatError::field(path, "recording", why))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_not_read_name_the_way_around() {
        let dir = tempfile::tempdir().expect("temporary folder");
        for (name, way) in [("a.ONI", "depth/N.png"), ("a.avi", ".mkv, .npz, .r3d")] {
            let path = dir.path().join(name);
            std::fs::write(&path, b"NI10").expect("written");
            let e = open_recording(&path).err().expect("must be refused");
            assert!(e.to_string().contains(way), "{e}");
        }
    }
}
