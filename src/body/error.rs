//! Faults of a body's data.

use tryon_geometry::mesh::MeshError;

/// A fault of a body's data.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// A joint at fault.
    #[error("joint `{joint}`: {why}")]
    Joint {
        /// Joint name.
        joint: String,
        /// Reason.
        why: String,
    },
    /// A vertex at fault.
    #[error("vertex {vertex}: {why}")]
    Vertex {
        /// Vertex number.
        vertex: usize,
        /// Reason.
        why: String,
    },
    /// An array of the wrong size or type.
    #[error("array `{array}`: {why}")]
    Array {
        /// Array name as in the file.
        array: String,
        /// Reason.
        why: String,
    },
    /// The surface is not a proper mesh.
    #[error("body mesh: {0}")]
    Mesh(#[from] MeshError),
}
