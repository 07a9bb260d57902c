//! A patch of a sheet, compiled for the kernels: its owned vertices first, then rings of ghosts.
//!
//! A substep spreads information by one ring, so a patch with `rings` rings of ghosts can take that many substeps alone.
//! Then ghosts are copied from their owners. The number of patches belongs to the model, not to the machine, so bits do
//! not depend on the number of threads.

use super::blocks::{HingeBlock, QuadBlock};
use super::simd::Slot;

/// Neighbours of a vertex that fit a filter row: most vertices of a triangulation have six.
pub(super) const ROW: usize = 6;

/// Row of the mass filter for two consecutive vertices: neighbours, their weights, and the vertices' own weights.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FilterRow {
    pub(super) near: [[Slot; 2]; ROW],
    /// Two weights of both vertices each; the last entry holds the vertices' own weights and nothing.
    pub(super) by: [[[f32; 2]; 2]; ROW / 2 + 1],
}

/// Neighbour beyond the capacity of a [`FilterRow`].
#[derive(Clone, Copy, Debug)]
pub(super) struct FilterOverflow {
    pub(super) vertex: Slot,
    pub(super) near: Slot,
    pub(super) by: f32,
}

/// Immutable.
#[derive(Clone, Debug)]
pub struct PatchModel {
    /// Sheet vertex of each local one; the first [`PatchModel::owned`] belong to this patch.
    pub vertices: Vec<u32>,
    /// Number of owned vertices.
    pub owned: usize,
    /// First vertex of each island, and the end of the last: compact parts of the owned vertices that may sleep.
    pub islands: Vec<usize>,
    /// Number of vertices within each number of rings of the owned ones.
    pub(super) within: Vec<usize>,
    /// Owned vertices that are ghosts elsewhere.
    pub(super) border: Vec<u32>,
    /// Patch of each ghost and its index in that patch's border.
    pub(super) ghosts: Vec<[u32; 2]>,
    pub(super) inverse_mass: Vec<f32>,
    pub(super) quads: Vec<QuadBlock>,
    /// Edges, the lower end first; sorted.
    pub(super) ends: Vec<[u16; 2]>,
    pub(super) rest: Vec<f32>,
    pub(super) filter_rows: Vec<FilterRow>,
    pub(super) filter_overflow: Vec<FilterOverflow>,
    /// Coefficients of the mass filter, the lowest (1) first.
    pub(super) filter: Vec<f32>,
    /// Number of bending pairs of each vertex with a higher one.
    pub(super) bend_count: Vec<u16>,
    pub(super) bend: Vec<(Slot, f32)>,
    pub(super) bent: Vec<HingeBlock>,
    pub(super) damping: f32,
    /// Drag of the air, ½ ρ C (kg/m³).
    pub(super) air: f32,
}

impl PatchModel {
    /// Number of vertices that are computed where all within `rings` rings of the owned ones must be right.
    pub(super) fn reach(&self, rings: usize) -> usize {
        self.within
            .get(rings)
            .copied()
            .unwrap_or(self.vertices.len())
    }
}
