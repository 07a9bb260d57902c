//! Expansion of one triangle as blocks of its vertices.

use nalgebra::Matrix3;
use tryon_geometry::math::{ElementEnergy, V3d};

/// Expansion of a triangle: its gradient, and the blocks (i, j), i ≤ j, row by row.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Packed {
    pub(super) value: f64,
    pub(super) gradient: [V3d; 3],
    pub(super) blocks: [Matrix3<f64>; 6],
}

impl Packed {
    /// Upper blocks of an expansion.
    pub(super) fn new(e: &ElementEnergy<9>) -> Self {
        let mut out = Self {
            value: e.value,
            ..Self::default()
        };
        let mut p = 0;
        for i in 0..3 {
            out.gradient[i] = e.gradient.fixed_rows::<3>(3 * i).into();
            for j in i..3 {
                out.blocks[p] = e.hessian.fixed_view::<3, 3>(3 * i, 3 * j).into();
                p += 1;
            }
        }
        out
    }
}
