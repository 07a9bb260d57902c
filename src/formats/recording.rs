//! Recordings by their path: an RGBD folder, or a file by its extension.

use super::rgbd_source::RgbdSource;
use super::{FormatError, K4aReader, McapReader, R3dReader, RgbdFolder};
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

/// Opens a recording: an RGBD folder, or a file by its extension: `.mcap`, `.mkv` (Azure Kinect),
/// `.r3d` (Record3D).
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
        return Ok(Box::new(RgbdFolder::open_with(
            path,
            options.camera.as_deref(),
        )?));
    }
    let extension = path.extension().and_then(|e| e.to_str());
    match extension.unwrap_or_default().to_ascii_lowercase().as_str() {
        "mcap" => Ok(Box::new(McapReader::open(path)?)),
        "mkv" => Ok(Box::new(K4aReader::open(path)?)),
        "r3d" => Ok(Box::new(R3dReader::open(path)?)),
        _ => Err(FormatError::field(
            path,
            "recording",
            "expected a folder with camera.json, or a file ending in .mcap, .mkv or .r3d",
        )),
    }
}
