//! Status of a tracker.

use serde::{Deserialize, Serialize};

/// Reason for having no live pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LostReason {
    /// No readings of a body's size.
    NoPerson,
    /// The body explains too little of the readings.
    Residual,
    /// The body lies in measured free space, or leaves much of the subject uncovered.
    Disagreement,
    /// It is no person.
    Thing,
    /// The result of a step was not finite and was discarded.
    NotFinite,
}

/// Status of a tracker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Nobody has been found yet.
    Searching,
    /// A subject is tracked; no size of a garment can be chosen yet, as that of the body still changes.
    Calibrating,
    /// A subject is tracked whose size has settled.
    Tracking,
    /// A subject is tracked who sits: garments are draped on people who stand.
    Sitting,
    /// The subject was lost; the last good pose is kept.
    Lost {
        /// Reason.
        reason: LostReason,
    },
}

impl Status {
    /// True with a pose of this very frame.
    pub fn is_live(&self) -> bool {
        matches!(self, Self::Calibrating | Self::Tracking | Self::Sitting)
    }
}
