//! Errors of a model of elasticity.

/// Fault of a rest shape or of a fabric.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ElasticError {
    /// A face names a vertex that does not exist, or one vertex twice.
    #[error("face {0}: its vertices are out of range or not three")]
    Face(usize),
    /// A triangle without area at rest, or with a coordinate that is not finite.
    #[error("face {face}: rest area {area} m² is not usable")]
    Area {
        /// Face number.
        face: usize,
        /// Rest area (m²).
        area: f64,
    },
    /// Arrays of different lengths.
    #[error("{field}: {found} entries, {needed} are needed")]
    Length {
        /// Name of the array.
        field: &'static str,
        /// Its length.
        found: usize,
        /// Length asked for.
        needed: usize,
    },
    /// An edge with more than two faces, or faces oriented against each other.
    #[error("edge ({0}, {1}): more than two faces, or faces oriented against each other")]
    Edge(u32, u32),
    /// A stiffness or density that no sheet has.
    #[error("fabric: {field} = {value} is not usable")]
    Fabric {
        /// Name of the quantity.
        field: &'static str,
        /// Its value.
        value: f64,
    },
}
