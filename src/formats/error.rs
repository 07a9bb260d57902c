//! Error of everything that reads or writes files.

use std::path::{Path, PathBuf};

/// Unreadable or unwritable file, and the field at fault.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// The operating system refused.
    #[error("{}: {why}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// Error of the system. Not a `source`, since the message contains it.
        why: std::io::Error,
    },
    /// A field is unusable.
    #[error("{}: `{field}`: {why}", file.display())]
    Field {
        /// The file.
        file: PathBuf,
        /// The field, array or record.
        field: String,
        /// The fault and the expectation.
        why: String,
    },
}

impl FormatError {
    /// An error of the operating system on `file`.
    pub fn io(file: &Path, source: std::io::Error) -> Self {
        Self::Io {
            file: file.to_owned(),
            why: source,
        }
    }
    /// A bad field of `file`.
    pub fn field(file: &Path, field: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Field {
            file: file.to_owned(),
            field: field.into(),
            why: why.into(),
        }
    }
    /// A frame of `file` that cannot be converted.
    pub(crate) fn frame(file: &Path, sequence: u64, why: impl std::fmt::Display) -> Self {
        Self::field(file, format!("frame {sequence}"), why.to_string())
    }
}
