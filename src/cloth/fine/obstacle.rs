//! Scripted obstacle whose surface yields where it squeezes cloth.
//!
//! A tracked body lies in itself at armpits and thighs; cloth between two parts has no place there. Each obstacle vertex is
//! therefore an unknown, held at its scripted target by a spring that is stiff up to the give and soft beyond it.

use super::newton::NewtonSystem;
use crate::settings::ObstacleSpring;
use nalgebra::Matrix3;
use tryon_geometry::math::V3d;

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
