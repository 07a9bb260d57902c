//! Comparison of a body that was measured before with the person who is found, by what fits leave over.

use crate::settings::ShapeSettings;
use serde::{Deserialize, Serialize};

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
    pub(crate) fn compare(&mut self, residual: f64, settings: &ShapeSettings) -> Option<bool> {
        self.least = self.least.min(residual);
        self.frames += 1;
        let most = settings.residual_ratio * self.before + settings.residual_allowance;
        (self.frames >= settings.probation_frames).then_some(self.least > most)
    }
}
