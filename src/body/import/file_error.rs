//! Faults of a body's file.

use crate::BodyError;
use tryon_formats::FormatError;

/// Why a body's file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BodyFileError {
    /// The file is at fault.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// Its arrays do not make a body.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// Its tree of joints is no person's.
    #[error("`kintree_table`, `J`: {0}")]
    Joints(String),
    /// Left and right cannot be told.
    #[error("left and right: {0}; name them in `joint_names` (left_hip, right_hip, …)")]
    Sides(String),
    /// Unit, axes or volume are no person's, or ambiguous.
    #[error("{0}")]
    Frame(String),
    /// With the path of the file.
    #[error("{}: {why}", file.display())]
    At {
        /// The file.
        file: std::path::PathBuf,
        /// The fault.
        why: Box<BodyFileError>,
    },
}
