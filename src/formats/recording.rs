//! Recordings by their path: an RGBD folder or an MCAP file.

use super::mcap_file::McapMessages;
use super::messages::{MessageSource, StreamOptions};
use super::rgbd_source::RgbdSource;
use super::{FormatError, RgbdFolder};
use std::path::{Path, PathBuf};

/// What a recording leaves to its reader.
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

/// Opens a recording: an RGBD folder, or a file with the extension `.mcap`.
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
    if kind.is_dir() {
        return Ok(Box::new(RgbdFolder::open(path)?));
    }
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("mcap"))
    {
        let streams = options.streams();
        return Ok(Box::new(MessageSource::open(
            path,
            McapMessages::open,
            streams,
        )?));
    }
    Err(FormatError::field(
        path,
        "recording",
        "expected a folder with camera.json, or a file ending in .mcap",
    ))
}
