//! Recordings by their path: an RGBD folder, or messages in MCAP, a ROS bag or rosbag2.

use super::bag_file::BagMessages;
use super::mcap_file::McapMessages;
use super::messages::{MessageSource, OpenContainer, StreamOptions};
use super::rgbd_source::RgbdSource;
use super::rosbag2::{self, SqliteMessages};
use super::{FormatError, RgbdFolder};
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

/// Opens a recording: an RGBD folder, a rosbag2 folder, or a file ending in `.mcap`, `.bag` or `.db3`.
///
/// # Errors
/// No such file or folder, neither of both, or an unusable calibration.
pub fn open_recording(path: &Path) -> Result<Box<dyn RgbdSource>, FormatError> {
    open_recording_with(path, &RecordingOptions::default())
}

/// As [`open_recording`], with choices.
///
/// # Errors
/// As [`open_recording`], and a topic that the recording lacks.
pub fn open_recording_with(
    path: &Path,
    options: &RecordingOptions,
) -> Result<Box<dyn RgbdSource>, FormatError> {
    let kind = std::fs::metadata(path).map_err(|e| FormatError::io(path, e))?;
    if kind.is_dir() && !rosbag2::is_folder(path) {
        return Ok(Box::new(RgbdFolder::open(path)?));
    }
    let open = container(path, kind.is_dir())?;
    Ok(Box::new(MessageSource::open(
        path,
        open,
        options.streams(),
    )?))
}

/// Reader of a recording of messages, by the extension of its file.
fn container(path: &Path, is_folder: bool) -> Result<OpenContainer, FormatError> {
    if is_folder {
        return Ok(rosbag2::open_folder);
    }
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    match extension.to_str() {
        Some("mcap") => Ok(McapMessages::open),
        Some("bag") => Ok(BagMessages::open),
        Some("db3") => Ok(SqliteMessages::open),
        _ => {
            let why = "expected a folder with camera.json or metadata.yaml, or a file ending in \
                       .mcap, .bag or .db3";
            Err(FormatError::field(path, "recording", why))
        }
    }
}
