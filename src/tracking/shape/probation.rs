//! Comparison of a body that was measured before with the person who is found, by what fits leave over.

use serde::{Deserialize, Serialize};

/// Frames over which residuals are compared: one alone may be of a pose in motion.
pub(crate) const PROBATION: u32 = 8;
/// Largest ratio of the least residual of [`PROBATION`] frames to the earlier one, and what is added to it, metres: fits of
/// one person stay within a third, a girth 6 cm off doubles them.
const RESIDUALS: (f64, f64) = (1.5, 5e-4);

/// Comparison of a known body with the person who was found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Probation {
    /// Residual of the earlier fits, metres.
    pub(crate) before: f64,
    /// Least residual since, metres.
    least: f64,
    /// Frames compared.
    pub(crate) frames: u32,
}

impl Probation {
    pub(crate) fn begin(before: f64) -> Self {
        Self {
            before,
            least: f64::MAX,
            frames: 0,
        }
    }

    /// Adds the residual of a frame; once all are in, true for another person.
    pub(crate) fn compare(&mut self, residual: f64) -> Option<bool> {
        self.least = self.least.min(residual);
        self.frames += 1;
        let (ratio, added) = RESIDUALS;
        (self.frames >= PROBATION).then_some(self.least > ratio * self.before + added)
    }
}
