//! The elastic sheet as an energy term.

use super::energy_term::EnergyTerm;
use crate::elastic::{ClothModel, ElasticExpansion, SheetMotion};
use std::sync::{Mutex, PoisonError};
use tryon_geometry::linear::{BlockMatrix, BlockPattern};
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Membranes and hinges of a sheet.
#[derive(Debug)]
pub struct ElasticTerm {
    model: ClothModel,
    /// Storage indices of the diagonal blocks, and of each pair's block and its transpose.
    diagonal: Vec<u32>,
    pairs: Vec<[u32; 2]>,
    scratch: Mutex<ElasticExpansion>,
}

impl ElasticTerm {
    /// Term of a model; [`EnergyTerm::bind`] before the first assembly.
    pub fn new(model: ClothModel) -> Self {
        Self {
            model,
            diagonal: Vec::new(),
            pairs: Vec::new(),
            scratch: Mutex::default(),
        }
    }
}

impl EnergyTerm for ElasticTerm {
    fn visit_pairs(&self, visit: &mut dyn FnMut(u32, u32)) {
        for [a, b] in self.model.pairs() {
            visit(*a, *b);
        }
    }

    fn bind(&mut self, pattern: &BlockPattern) {
        let slot = |a: u32, b: u32| pattern.slot(a, b).map_or(u32::MAX, |s| s as u32);
        self.diagonal = (0..self.model.vertex_count() as u32)
            .map(|i| slot(i, i))
            .collect();
        let pairs = self.model.pairs().iter();
        self.pairs = pairs.map(|[a, b]| [slot(*a, *b), slot(*b, *a)]).collect();
    }

    fn value(&self, par: Par, at: &SheetMotion<'_>) -> f64 {
        self.model.moved_energy(par, at)
    }

    fn assemble(
        &self,
        par: Par,
        at: &SheetMotion<'_>,
        gradient: &mut [V3d],
        hessian: &mut BlockMatrix,
    ) -> f64 {
        let mut scratch = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        self.model.moved_expansion(par, at, &mut scratch);
        for (g, own) in gradient.iter_mut().zip(&scratch.gradient) {
            *g += own;
        }
        for (slot, block) in self.diagonal.iter().zip(&scratch.diagonal) {
            *hessian.block_mut(*slot as usize) += block;
        }
        for ([upper, lower], block) in self.pairs.iter().zip(&scratch.off_diagonal) {
            *hessian.block_mut(*upper as usize) += block;
            *hessian.block_mut(*lower as usize) += block.transpose();
        }
        scratch.value
    }
}
