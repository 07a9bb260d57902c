//! Recordings by their path: an RGBD folder or an MCAP file.

use super::rgbd_source::RgbdSource;
use super::{FormatError, McapReader, RgbdFolder};
use std::path::Path;

/// Opens a recording: an RGBD folder, or a file with the extension `.mcap`.
///
/// # Errors
/// No such file or folder, neither of both, or an unusable calibration.
pub fn open_recording(path: &Path) -> Result<Box<dyn RgbdSource>, FormatError> {
    let kind = std::fs::metadata(path).map_err(|e| FormatError::io(path, e))?;
    if kind.is_dir() {
        return Ok(Box::new(RgbdFolder::open(path)?));
    }
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("mcap"))
    {
        return Ok(Box::new(McapReader::open(path)?));
    }
    Err(FormatError::field(
        path,
        "recording",
        "expected a folder with camera.json, or a file ending in .mcap",
    ))
}
