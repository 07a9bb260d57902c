//! Expansion of one element as blocks of its vertices.

use nalgebra::Matrix3;
use tryon_geometry::math::{ElementEnergy, V3d};

/// Expansion of an element of `K` vertices: its gradient, and the `P` = K(K+1)/2 blocks (i, j), i ≤ j, row by row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Packed<const K: usize, const P: usize> {
    pub(super) value: f64,
    pub(super) gradient: [V3d; K],
    pub(super) blocks: [Matrix3<f64>; P],
}

impl<const K: usize, const P: usize> Default for Packed<K, P> {
    fn default() -> Self {
        Self {
            value: 0.0,
            gradient: [V3d::zeros(); K],
            blocks: [Matrix3::zeros(); P],
        }
    }
}

impl<const K: usize, const P: usize> Packed<K, P> {
    /// Upper blocks of an expansion, `N` = 3 K.
    pub(super) fn new<const N: usize>(e: &ElementEnergy<N>) -> Self {
        let mut out = Self {
            value: e.value,
            ..Self::default()
        };
        let mut p = 0;
        for i in 0..K {
            out.gradient[i] = e.gradient.fixed_rows::<3>(3 * i).into();
            for j in i..K {
                out.blocks[p] = e.hessian.fixed_view::<3, 3>(3 * i, 3 * j).into();
                p += 1;
            }
        }
        out
    }
}
