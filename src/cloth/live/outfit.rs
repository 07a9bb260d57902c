//! Garments that have been put on one body, and their anchors.

use serde::{Deserialize, Serialize};
use tryon_garment::GarmentMesh;
use tryon_geometry::math::{P3, V3};

/// A garment vertex attached to a triangle of the body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnchorBinding {
    /// Simulation vertex.
    pub vertex: u32,
    /// Body triangle.
    pub body: [u32; 3],
    /// Barycentric weights.
    pub weights: [f32; 3],
    /// Height above the triangle along its normal, metres.
    pub height: f32,
    /// Strength, 0 (none) to 1 (rigid).
    pub strength: f64,
}

impl AnchorBinding {
    /// Position on a triangle with these corners, metres.
    pub fn position(&self, [p, q, r]: [P3; 3]) -> P3 {
        let w = self.weights;
        let on = p.coords * w[0] + q.coords * w[1] + r.coords * w[2];
        let normal = (q - p).cross(&(r - p)).try_normalize(0.0);
        P3::from(on + normal.unwrap_or_else(V3::zeros) * self.height)
    }
}

/// Garment meshes and what attaches them to one body, innermost layer first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outfit {
    /// Garments, innermost layer first.
    pub garments: Vec<GarmentMesh>,
    /// Anchors of each garment.
    pub anchors: Vec<Vec<AnchorBinding>>,
}
