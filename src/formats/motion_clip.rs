//! Recorded motion: positions of every joint in every frame.

use tryon_geometry::math::P3d;

/// A motion clip. Lengths in the file's own unit (its user scales by bone lengths) and axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionClip {
    /// Names of joints as in the file; the far end of a last bone is `NAME_end`. Shape `[joints]`.
    pub names: Vec<String>,
    /// Parent of each joint, `None` for a root; parents come first. Shape `[joints]`.
    pub parents: Vec<Option<usize>>,
    /// Positions with no joint turned: the rest pose that bones' lengths come from. Shape `[joints]`.
    pub rest: Vec<P3d>,
    /// Positions, shape `[frames][joints]`.
    pub frames: Vec<Vec<P3d>>,
    /// Frame period, seconds.
    pub period: f64,
    /// The format says that y is up; else the people in it show it.
    pub is_y_up: bool,
    /// Statements about what was assumed or is unusual, one a sentence.
    pub notes: Vec<String>,
}

/// Frame period of the CMU motion database, seconds; its AMC files do not state it.
pub(super) const CMU_PERIOD: f64 = 1.0 / 120.0;
/// Angle of a joint below which it counts as not turned, radians: rounding of three decimals in degrees.
const TURNED: f64 = 1e-3;

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
    /// True if no bone of the first frame is turned against its parent's from the rest pose: a frame for calibration, often
    /// followed by a jump.
    pub fn first_is_rest(&self) -> bool {
        let Some(first) = self.frames.first() else {
            return false;
        };
        if self.rest.len() != first.len() || self.parents.len() != first.len() {
            return false;
        }
        let bone =
            |places: &[P3d], joint: usize| Some(places[joint] - places[self.parents[joint]?]);
        let mut bones = (0..first.len()).filter_map(|joint| {
            let (a, b) = (bone(&self.rest, joint)?, bone(first, joint)?);
            (a.norm() > 0.0 && b.norm() > 0.0).then_some((joint, a, b))
        });
        // The angle between a bone and its parent's is the same in both poses.
        bones.all(|(joint, a, b)| {
            let above =
                self.parents[joint].and_then(|p| Some((bone(&self.rest, p)?, bone(first, p)?)));
            above.is_none_or(|(c, d)| {
                c.norm() == 0.0 || d.norm() == 0.0 || (a.angle(&c) - b.angle(&d)).abs() < TURNED
            })
        })
    }
    /// Frame rate and role of the first frame in words, and the notes of the file.
    pub fn statements(&self) -> Vec<String> {
        let first = match self.first_is_rest() {
            true => "its first frame is the rest pose, and is played as a frame",
            false => "its first frame is not the rest pose, and is played as a frame",
        };
        let rate = format!(
            "{} frames of {:.4} s ({:.3} a second), {first}",
            self.frames.len(),
            self.period,
            1.0 / self.period
        );
        std::iter::once(rate)
            .chain(self.notes.iter().cloned())
            .collect()
    }
}
