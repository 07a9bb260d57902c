//! Recorded motion: positions of every joint in every frame.

use tryon_geometry::math::P3d;

/// A motion clip. Lengths in the file's own unit (its user scales by bone lengths), y up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionClip {
    /// Names of joints as in the file; the far end of a last bone is `NAME_end`. Shape `[joints]`.
    pub names: Vec<String>,
    /// Positions, shape `[frames][joints]`.
    pub frames: Vec<Vec<P3d>>,
    /// Frame period, seconds.
    pub period: f64,
}

/// Frame period of the CMU motion database, seconds; its AMC files do not state it.
pub(super) const CMU_PERIOD: f64 = 1.0 / 120.0;

impl MotionClip {
    /// Index of the first of these names in the clip, case-insensitive.
    pub fn joint(&self, names: &[&str]) -> Option<usize> {
        names
            .iter()
            .find_map(|n| self.names.iter().position(|m| m.eq_ignore_ascii_case(n)))
    }
    /// Length, seconds.
    pub fn seconds(&self) -> f64 {
        self.frames.len() as f64 * self.period
    }
    /// The clip at the CMU database's 120 Hz: some conversions state 25 Hz and contain every frame.
    #[must_use]
    pub fn at_cmu_rate(self) -> Self {
        Self {
            period: CMU_PERIOD,
            ..self
        }
    }
}
