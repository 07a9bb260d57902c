//! Faults of cloth, with the triangle, vertex or setting at fault.

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
    /// A value that is not finite, before or after a step.
    #[error("{what} {index} is not finite")]
    NotFinite {
        /// Kind: `cloth vertex`, `body vertex`, …
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// An array of the wrong size.
    #[error("{what}: {got} given, {expected} expected")]
    Count {
        /// Kind of elements.
        what: &'static str,
        /// Number given.
        got: usize,
        /// Number expected.
        expected: usize,
    },
    /// A setting that cannot be used.
    #[error("{field}: {why}")]
    Field {
        /// Field name.
        field: String,
        /// The fault.
        why: String,
    },
    /// The mesh is not a proper surface.
    #[error("cloth mesh: {0}")]
    Mesh(#[from] tryon_geometry::mesh::MeshError),
    /// The garment is at fault.
    #[error(transparent)]
    Garment(#[from] tryon_garment::GarmentError),
}

impl ClothError {
    /// A setting that cannot be used.
    pub(crate) fn field(field: &str, why: &str) -> Self {
        Self::Field {
            field: field.to_owned(),
            why: why.to_owned(),
        }
    }
}
