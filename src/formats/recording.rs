//! Recordings by their path: an RGBD folder, or a file by its extension.

use super::rectified::Rectified;
use super::rgbd_source::RgbdSource;
use super::{FormatError, K4aReader, McapReader, NpzReader, R3dReader, RgbdFolder};
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

/// Way around OpenNI's recordings, whose depth is in codecs of their own.
const NO_ONI: &str = "OpenNI's .oni is not read: play it with OpenNI 2 (in Python, openni2.Device.open_file), save its \
    frames as depth/N.png (16-bit millimetres) and rgb/N.png beside a camera.json, and pass that folder";

/// Opens a recording: an RGBD folder, or a file by its extension: `.mcap`, `.mkv` (Azure Kinect),
/// `.npz` or `.r3d` (Record3D).
///
/// # Errors
/// No such file or folder, neither of both, or an unusable calibration.
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
    Ok(Rectified::wrap(path, open_raw(path, options)?))
}

/// Opens a recording, lens distortion included.
fn open_raw(path: &Path, options: &RecordingOptions) -> Result<Box<dyn RgbdSource>, FormatError> {
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
        "mkv" => Ok(Box::new(K4aReader::open_with(
            path,
            options.camera.as_deref(),
        )?)),
        "npz" => Ok(Box::new(NpzReader::open(path, options.camera.as_deref())?)),
        "oni" => Err(FormatError::field(path, "recording", NO_ONI)),
        "r3d" => Ok(Box::new(R3dReader::open_with(
            path,
            options.camera.as_deref(),
        )?)),
        _ => Err(FormatError::field(
            path,
            "recording",
            "expected a folder with camera.json, or a file ending in .mcap, .mkv, .npz or .r3d",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_not_read_name_the_way_around() {
        let dir = tempfile::tempdir().expect("temporary folder");
        for (name, way) in [("a.ONI", "depth/N.png"), ("a.avi", ".mkv, .npz or .r3d")] {
            let path = dir.path().join(name);
            std::fs::write(&path, b"NI10").expect("written");
            let e = open_recording(&path).err().expect("must be refused");
            assert!(e.to_string().contains(way), "{e}");
        }
    }
}
