//! Scripted obstacle whose surface yields where it squeezes cloth.
//!
//! A tracked body lies in itself at armpits and thighs; cloth between two parts has no place there. Each obstacle vertex is
//! therefore an unknown, held at its scripted target by a spring that is stiff up to the give and soft beyond it.

use super::newton::NewtonSystem;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::V3d;

/// Spring between an obstacle vertex and its target: E = k δ² (√(1 + d²/δ²) − 1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObstacleSpring {
    /// k (N/m): stiffness near the target. Smaller: skin yields visibly to cloth that lies on it.
    pub stiffness: f64,
    /// δ (m): displacement from which the force, at most k δ, saturates.
    pub give: f64,
}

impl Default for ObstacleSpring {
    fn default() -> Self {
        Self {
            stiffness: 1e4,
            give: 1e-3,
        }
    }
}

impl ObstacleSpring {
    /// Energy (J) at a displacement `d` from the target (m).
    pub(super) fn value(&self, d: &V3d) -> f64 {
        // k δ² (s − 1) without cancellation.
        self.stiffness * d.norm_squared() / (1.0 + self.root(d))
    }

    fn root(&self, d: &V3d) -> f64 {
        (1.0 + d.norm_squared() / (self.give * self.give)).sqrt()
    }

    /// Adds the spring of a vertex to `out`. The curvature k/s majorises the energy, so that one iteration reaches the target
    /// from any distance.
    pub(super) fn assemble(&self, vertex: usize, d: &V3d, out: &mut NewtonSystem) {
        let stiffness = self.stiffness / self.root(d);
        out.value += self.value(d);
        out.add_diagonal(
            vertex,
            d * stiffness,
            Matrix3::from_diagonal_element(stiffness),
        );
    }
}
