//! One result of a check, for people and scripts.

use serde::Serialize;

/// Grade of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Rating {
    /// As it should be.
    Good,
    /// Works with limits; the text has the remedy.
    Note,
    /// Something will fail; the text has the remedy.
    Bad,
}

/// Result of one check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Subject, a word or two.
    pub what: &'static str,
    /// Grade.
    pub verdict: Rating,
    /// Measurement, and the remedy where something is to be done.
    pub detail: String,
}

impl Finding {
    /// As it should be.
    pub fn good(what: &'static str, detail: impl Into<String>) -> Self {
        Self::new(what, Rating::Good, detail)
    }
    /// Works with limits.
    pub fn note(what: &'static str, detail: impl Into<String>) -> Self {
        Self::new(what, Rating::Note, detail)
    }
    /// Something will fail.
    pub fn bad(what: &'static str, detail: impl Into<String>) -> Self {
        Self::new(what, Rating::Bad, detail)
    }
    /// With its grade.
    pub fn new(what: &'static str, verdict: Rating, detail: impl Into<String>) -> Self {
        Self {
            what,
            verdict,
            detail: detail.into(),
        }
    }
}
