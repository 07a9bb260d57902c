//! Expansion of the bending energy around one vertex.

use super::Dihedral;
use nalgebra::Matrix3;
use tryon_geometry::math::V3d;

/// Second-order expansion of the energy of one fan: its Hessian's blocks are Jᵢᵀ C Jⱼ.
#[derive(Clone, Debug, Default)]
pub(super) struct FanExpansion {
    pub(super) value: f64,
    pub(super) gradient: Vec<V3d>,
    /// Jᵢ, the curvature by the position of vertex i (1/m²).
    pub(super) by_vertex: Vec<Matrix3<f64>>,
    /// C Jᵢ (N·m), C being the tangent times the area.
    pub(super) moments: Vec<Matrix3<f64>>,
}

/// Buffers of an expansion.
#[derive(Clone, Debug, Default)]
pub(super) struct CurvatureBuffers {
    pub(super) angles: Vec<Option<Dihedral>>,
    pub(super) fans: Vec<FanExpansion>,
}

/// Fan and places of two of its vertices.
pub(super) type Place = (u32, u16, u16);

impl FanExpansion {
    /// Becomes the expansion of a fan of so many vertices that has no energy.
    pub(super) fn clear(&mut self, vertices: usize) {
        self.value = 0.0;
        for list in [&mut self.by_vertex, &mut self.moments] {
            list.clear();
            list.resize(vertices, Matrix3::zeros());
        }
        self.gradient.clear();
        self.gradient.resize(vertices, V3d::zeros());
    }
    /// Block of the Hessian of two of the fan's vertices.
    pub(super) fn block(&self, &(_, a, b): &Place) -> Matrix3<f64> {
        self.by_vertex[a as usize].tr_mul(&self.moments[b as usize])
    }
}
