//! The one error of everything that reads or writes files.

use std::path::{Path, PathBuf};

/// A file that could not be read or written, and the field at fault.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// The operating system refused.
    #[error("{}: {why}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system said. Not a `source`, since the message says it already.
        why: std::io::Error,
    },
    /// A field holds something that cannot be used.
    #[error("{}: `{field}`: {why}", file.display())]
    Field {
        /// The file.
        file: PathBuf,
        /// The field, array or record.
        field: String,
        /// What is wrong and what would be right.
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
}
