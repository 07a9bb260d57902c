//! Motion files by their extension.

use super::FormatError;
use super::asf_amc::read_asf_amc;
use super::bvh::read_bvh;
use super::motion_clip::MotionClip;
use std::path::Path;

/// Reads a clip by its extension: `.bvh`, or `.amc` with the `.asf` of its subject beside it (`02_07.amc` → `02.asf`).
///
/// # Errors
/// Names the file, line and joint at fault.
pub fn read_motion(path: &Path) -> Result<MotionClip, FormatError> {
    let extension = path
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or_default()
        .to_ascii_lowercase();
    match extension.as_str() {
        "bvh" => read_bvh(path),
        "amc" => {
            let stem = path
                .file_stem()
                .and_then(|s| s.to_str())
                .unwrap_or_default();
            let subject = stem.split('_').next().unwrap_or(stem);
            read_asf_amc(&path.with_file_name(format!("{subject}.asf")), path)
        }
        _ => Err(FormatError::field(
            path,
            "motion",
            "expected a file extension in .bvh or .amc",
        )),
    }
}
