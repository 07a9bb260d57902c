//! Error of the colour model.

use std::path::{Path, PathBuf};

/// Command that makes the model's file.
const COMMAND: &str = "(cd tools/landmarks && npm ci && ./convert)";

/// Missing, foreign or unusable model.
#[derive(Debug, thiserror::Error)]
pub enum LandmarkError {
    /// There is no file.
    #[error("{}: no colour model here; make it by `{COMMAND}`, or do without: tracking then takes depth alone", file.display())]
    Missing {
        /// The path asked for.
        file: PathBuf,
    },
    /// The operating system refused.
    #[error("{}: {why}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// Error of the system. Not a `source`, since the message contains it.
        why: std::io::Error,
    },
    /// The file is not the one that the converter writes: cut short, changed, of another version, or something else.
    #[error(
        "{}: {bytes} bytes with SHA-256 {found}, but the colour model has {expected}; make it anew by `{COMMAND}`",
        file.display()
    )]
    Foreign {
        /// The file.
        file: PathBuf,
        /// Its length.
        bytes: u64,
        /// Its SHA-256, hexadecimal.
        found: String,
        /// That of the model.
        expected: &'static str,
    },
    /// A graph could not be loaded or run.
    #[error("colour model, {graph}: {why}")]
    Network {
        /// The graph or its tensor.
        graph: &'static str,
        /// Error of the runtime.
        why: String,
    },
}

impl LandmarkError {
    /// Error of the system while reading `file`.
    pub(crate) fn io(file: &Path, why: std::io::Error) -> Self {
        let file = file.to_owned();
        if why.kind() == std::io::ErrorKind::NotFound {
            return Self::Missing { file };
        }
        Self::Io { file, why }
    }
    /// Error of the runtime.
    pub(crate) fn network(graph: &'static str, why: impl std::fmt::Display) -> Self {
        Self::Network {
            graph,
            why: why.to_string(),
        }
    }
}
