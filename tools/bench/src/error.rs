//! Faults of a benchmark.

/// Benchmark that could not be run or written.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {why}")]
pub struct EvaluateError {
    /// Scene, file or row.
    what: String,
    why: String,
}

impl EvaluateError {
    pub(super) fn new(what: impl ToString, why: impl ToString) -> Self {
        Self {
            what: what.to_string(),
            why: why.to_string(),
        }
    }
}
