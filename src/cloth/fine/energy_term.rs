//! Sums of element energies over fixed stencils: elasticity, stitches, contact and friction alike.

use crate::elastic::SheetMotion;
use tryon_geometry::linear::{BlockMatrix, BlockPattern};
use tryon_geometry::math::{ElementEnergy, V3d};
use tryon_geometry::par::{self, Par};

/// Elements that one thread evaluates in a row.
const CHUNK: usize = 256;
/// Elements whose Hessians are kept at once: bounds scratch to 5 MB and keeps it in cache until it is added.
const BATCH: usize = 4096;

/// Energies of a list of elements with `V` vertices, `N = 3 V` unknowns.
pub trait EnergyElements<const V: usize, const N: usize>: Send + Sync {
    /// Number of elements.
    fn count(&self) -> usize;
    /// Vertices of an element, in the order of its unknowns.
    fn vertices(&self, element: usize) -> [u32; V];
    /// Energy (J) within a step.
    fn value(&self, element: usize, at: &SheetMotion<'_>) -> f64;
    /// Energy with its derivatives; the Hessian is positive semi-definite.
    fn expand(&self, element: usize, at: &SheetMotion<'_>) -> ElementEnergy<N>;
}

/// Energy that adds itself to a system on a [`BlockPattern`].
pub trait EnergyTerm: Send + Sync {
    /// Calls `visit` with each pair of vertices that share an element.
    fn visit_pairs(&self, visit: &mut dyn FnMut(u32, u32));
    /// Looks up where the blocks of each element go; call once a pattern.
    fn bind(&mut self, pattern: &BlockPattern);
    /// Energy (J) within a step; the bits do not depend on the threads.
    fn value(&self, par: Par, at: &SheetMotion<'_>) -> f64;
    /// Adds gradient (N) and Hessian (N/m) and returns the energy (J).
    fn assemble(
        &self,
        par: Par,
        at: &SheetMotion<'_>,
        gradient: &mut [V3d],
        hessian: &mut BlockMatrix,
    ) -> f64;
}

/// An [`EnergyElements`] as an [`EnergyTerm`].
#[derive(Clone, Debug)]
pub struct ElementTerm<S, const V: usize, const N: usize> {
    set: S,
    /// Storage index of each block of each element, `[element][row][column]`.
    slots: Vec<[[u32; V]; V]>,
}

impl<S: EnergyElements<V, N>, const V: usize, const N: usize> ElementTerm<S, V, N> {
    /// Term of a set; [`EnergyTerm::bind`] before the first assembly.
    pub fn new(set: S) -> Self {
        Self {
            set,
            slots: Vec::new(),
        }
    }
}

/// Sum of `value(i)` for `i < count`, in a fixed order.
pub(super) fn ordered_sum(par: Par, count: usize, value: impl Fn(usize) -> f64 + Sync) -> f64 {
    let mut sums = Vec::new();
    par::map_into(par, count.div_ceil(CHUNK), 1, &mut sums, |chunk| {
        let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(count);
        range.map(&value).sum::<f64>()
    });
    sums.iter().sum()
}

impl<S: EnergyElements<V, N>, const V: usize, const N: usize> EnergyTerm for ElementTerm<S, V, N> {
    fn visit_pairs(&self, visit: &mut dyn FnMut(u32, u32)) {
        for element in 0..self.set.count() {
            let v = self.set.vertices(element);
            for i in 0..V {
                for j in 0..i {
                    visit(v[i], v[j]);
                }
            }
        }
    }

    fn bind(&mut self, pattern: &BlockPattern) {
        self.slots.clear();
        self.slots.reserve(self.set.count());
        for element in 0..self.set.count() {
            let v = self.set.vertices(element);
            let slot = |a: u32, b: u32| pattern.slot(a, b).map_or(u32::MAX, |s| s as u32);
            self.slots.push(v.map(|a| v.map(|b| slot(a, b))));
        }
    }

    fn value(&self, par: Par, at: &SheetMotion<'_>) -> f64 {
        ordered_sum(par, self.set.count(), |k| {
            if at.is_asleep(&self.set.vertices(k)) {
                return 0.0;
            }
            self.set.value(k, at)
        })
    }

    fn assemble(
        &self,
        par: Par,
        at: &SheetMotion<'_>,
        gradient: &mut [V3d],
        hessian: &mut BlockMatrix,
    ) -> f64 {
        let mut sum = 0.0;
        let mut batch: Vec<ElementEnergy<N>> = Vec::new();
        for first in (0..self.set.count()).step_by(BATCH) {
            let count = BATCH.min(self.set.count() - first);
            par::map_into(par, count, CHUNK / 4, &mut batch, |k| {
                if at.is_asleep(&self.set.vertices(first + k)) {
                    return ElementEnergy::default();
                }
                self.set.expand(first + k, at)
            });
            for (k, energy) in batch.iter().enumerate() {
                sum += energy.value;
                let v = self.set.vertices(first + k);
                let slots = &self.slots[first + k];
                for i in 0..V {
                    gradient[v[i] as usize] += energy.gradient.fixed_rows::<3>(3 * i);
                    for j in 0..V {
                        *hessian.block_mut(slots[i][j] as usize) +=
                            energy.hessian.fixed_view::<3, 3>(3 * i, 3 * j);
                    }
                }
            }
        }
        sum
    }
}
