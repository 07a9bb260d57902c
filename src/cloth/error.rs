//! What can go wrong with cloth, and where.

/// A fault of a sheet, an input or a step.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ClothError {
    /// A triangle without area, or with an angle too small to compute with.
    #[error("triangle {face}: its rest area of {area:e} m² is too small")]
    ZeroArea {
        /// Triangle.
        face: usize,
        /// Its area, m².
        area: f64,
    },
    /// A number that is not finite, before or after a step.
    #[error("{what} {index} is not finite")]
    NotFinite {
        /// What kind of thing: `cloth vertex`, `body vertex`, …
        what: &'static str,
        /// Which one.
        index: usize,
    },
    /// An array that does not fit.
    #[error("{what}: {got} given, {expected} expected")]
    Count {
        /// What was counted.
        what: &'static str,
        /// How many came.
        got: usize,
        /// How many fit.
        expected: usize,
    },
    /// A setting that cannot be used.
    #[error("{field}: {why}")]
    Field {
        /// Field name.
        field: String,
        /// What is wrong.
        why: String,
    },
    /// The system of equations could not be factored.
    #[error("cloth system: {0}")]
    Linear(#[from] crate::linear::LinearError),
    /// The mesh is not a proper surface.
    #[error("cloth mesh: {0}")]
    Mesh(#[from] crate::mesh::MeshError),
    /// The garment is at fault.
    #[error(transparent)]
    Garment(#[from] crate::garment::GarmentError),
}
