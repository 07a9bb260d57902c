//! Recorded motion: where every joint was in every frame.

use super::FormatError;
use crate::math::P3d;
use std::path::Path;

/// A motion clip. Lengths in the file's own unit (its user scales by bone lengths), y up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionClip {
    /// Names of joints as in the file; the far end of a last bone is `NAME_end`. Shape `[joints]`.
    pub names: Vec<String>,
    /// Positions, shape `[frames][joints]`.
    pub frames: Vec<Vec<P3d>>,
    /// Seconds from frame to frame.
    pub period: f64,
}

/// The rate of the CMU motion database, seconds.
const CMU_PERIOD: f64 = 1.0 / 120.0;

impl MotionClip {
    /// Index of the first of these names that the clip has, upper and lower case alike.
    pub fn joint(&self, names: &[&str]) -> Option<usize> {
        names
            .iter()
            .find_map(|n| self.names.iter().position(|m| m.eq_ignore_ascii_case(n)))
    }
    /// Length, seconds.
    pub fn seconds(&self) -> f64 {
        self.frames.len() as f64 * self.period
    }
    /// The clip played at the CMU database's 120 frames a second: some conversions claim 25 and hold every frame.
    #[must_use]
    pub fn at_cmu_rate(self) -> Self {
        Self {
            period: CMU_PERIOD,
            ..self
        }
    }
}

/// Reads a clip by its ending: `.bvh`, or `.amc` with the `.asf` of its subject beside it (`02_07.amc` → `02.asf`).
///
/// # Errors
/// Names the file, line and joint at fault.
pub fn read_motion(path: &Path) -> Result<MotionClip, FormatError> {
    let ending = path
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or_default()
        .to_ascii_lowercase();
    match ending.as_str() {
        "bvh" => super::bvh::read_bvh(path),
        "amc" => {
            let stem = path
                .file_stem()
                .and_then(|s| s.to_str())
                .unwrap_or_default();
            let subject = stem.split('_').next().unwrap_or(stem);
            super::asf_amc::read_asf_amc(&path.with_file_name(format!("{subject}.asf")), path)
        }
        _ => Err(FormatError::field(
            path,
            "motion",
            "expected a file ending in .bvh or .amc",
        )),
    }
}
