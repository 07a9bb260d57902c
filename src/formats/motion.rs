//! Motion files by their extension.

use super::FormatError;
use super::amass::read_amass;
use super::asf_amc::read_asf_amc;
use super::bvh::read_bvh;
use super::motion_clip::MotionClip;
use std::path::{Path, PathBuf};

/// Reads a clip by its extension: `.bvh`; `.npz` of AMASS; `.amc` with the `.asf` of its name or of its subject beside it
/// (`02_07.amc` → `02.asf`).
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
        "npz" => read_amass(path),
        "amc" => read_asf_amc(&skeleton_of(path), path),
        _ => Err(FormatError::field(
            path,
            "motion",
            "expected a file extension in .bvh, .amc (with its .asf) or .npz (AMASS)",
        )),
    }
}

/// Skeleton of an AMC file: of the same name, or of the subject that its name begins with.
fn skeleton_of(path: &Path) -> PathBuf {
    let own = path.with_extension("asf");
    if own.exists() {
        return own;
    }
    let stem = path
        .file_stem()
        .and_then(|s| s.to_str())
        .unwrap_or_default();
    let subject = stem.split('_').next().unwrap_or(stem);
    path.with_file_name(format!("{subject}.asf"))
}
