//! What every recording offers: a calibration and frames in order.

use super::{FormatError, McapReader, RgbdFolder};
use crate::camera::{Calibration, RgbdFrame};
use std::path::Path;

/// Frames of one camera, in capture order.
pub trait RgbdSource: Send {
    /// What holds for all frames.
    fn calibration(&self) -> &Calibration;
    /// Number of frames, when known without reading them all.
    fn len(&self) -> Option<usize>;
    /// Whether it is known to hold no frame at all.
    fn is_empty(&self) -> bool {
        self.len() == Some(0)
    }
    /// The next frame; `None` at the end. After an error the next call goes on with the frame after the bad one.
    ///
    /// # Errors
    /// Names the file and the field of this frame.
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError>;
    /// Back to the first frame.
    ///
    /// # Errors
    /// When the file cannot be read again.
    fn rewind(&mut self) -> Result<(), FormatError>;
}

/// Opens a recording: an RGBD folder, or a file that ends in `.mcap`.
///
/// # Errors
/// When there is no such file or folder, when it is neither, or when its calibration cannot be used.
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
