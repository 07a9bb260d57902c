//! Linear shape space of a template.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::V3;

/// Linear directions of body shape.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ShapeSpace {
    /// Name of each direction.
    pub names: Vec<String>,
    /// Vertex offsets per unit of each coefficient (one standard deviation), metres, shape `[directions][vertices]`.
    pub vertices: Vec<Vec<V3>>,
    /// Joint offsets per unit, metres, shape `[directions][joints]`.
    pub joints: Vec<Vec<Vector3<f64>>>,
}
