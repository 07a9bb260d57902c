//! Faults of a benchmark.

use std::path::PathBuf;

/// Benchmark that could not be run or written.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// A file.
    #[error("cannot write {path}: {source}")]
    File {
        /// Its path.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A plot.
    #[error("cannot draw the plot of `{error}`: {why}")]
    Plot {
        /// Measure of error.
        error: String,
        /// Why.
        why: String,
    },
    /// A scene that could not be read or made.
    #[error("scene `{scene}`: {why}")]
    Scene {
        /// Its name.
        scene: String,
        /// Why.
        why: String,
    },
}
