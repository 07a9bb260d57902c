//! Error of a pattern or garment.

/// A fault in a pattern or garment, naming the panel, edge, seam or vertex.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GarmentError {
    /// No garment of this name in the library.
    #[error("there is no garment `{name}`; known are {known}")]
    UnknownGarment {
        /// The name asked for.
        name: String,
        /// Known names.
        known: String,
    },
    /// A size label that does not exist.
    #[error("there is no size `{0}`; sizes are XS, S, M, L, XL, XXL")]
    UnknownSize(String),
    /// A panel at fault.
    #[error("panel `{panel}`: {why}")]
    Panel {
        /// Panel name.
        panel: String,
        /// The fault.
        why: String,
    },
    /// An edge of a panel at fault.
    #[error("panel `{panel}`, edge `{edge}`: {why}")]
    Edge {
        /// Panel name.
        panel: String,
        /// Edge name.
        edge: String,
        /// The fault.
        why: String,
    },
    /// A seam at fault.
    #[error("seam {seam}: {why}")]
    Seam {
        /// Number of the seam in the pattern.
        seam: usize,
        /// The fault.
        why: String,
    },
    /// A vertex of the triangulated garment at fault.
    #[error("vertex {vertex}: {why}")]
    Vertex {
        /// Vertex number.
        vertex: usize,
        /// The fault.
        why: String,
    },
    /// A triangle of the garment at fault.
    #[error("triangle {face}: {why}")]
    Face {
        /// Triangle number.
        face: usize,
        /// The fault.
        why: String,
    },
    /// A field of a material, pattern or setting at fault.
    #[error("{field}: {why}")]
    Field {
        /// Field name.
        field: String,
        /// The fault.
        why: String,
    },
    /// The sewn mesh is not a proper surface.
    #[error("sewn garment: {0}")]
    Mesh(#[from] tryon_geometry::mesh::MeshError),
}
