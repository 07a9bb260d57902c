//! Static equilibrium of a small sheet under gravity, for tests: Newton's method with a line search.

use super::{ClothModel, ElasticExpansion};
use std::sync::Arc;
use tryon_geometry::linear::{Factor, SymbolicFactor, SymmetricPattern};
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Load and supports of a sheet.
pub(super) struct Statics<'a> {
    pub(super) model: &'a ClothModel,
    /// Acceleration by gravity (m/s²).
    pub(super) gravity: V3d,
    /// Held coordinates, shape `[vertices]`.
    pub(super) held: Vec<[bool; 3]>,
    /// Force on each vertex besides gravity (N), shape `[vertices]` or empty.
    pub(super) load: Vec<V3d>,
}

impl Statics<'_> {
    fn force(&self, i: usize) -> V3d {
        let load = self.load.get(i).copied().unwrap_or_default();
        self.gravity * self.model.masses()[i] + load
    }
    fn energy(&self, x: &[V3d]) -> f64 {
        let outer: f64 = (0..x.len()).map(|i| self.force(i).dot(&x[i])).sum();
        self.model.energy(Par::Seq, x) - outer
    }
    /// Brings `x` to equilibrium; returns the Newton steps.
    ///
    /// # Panics
    /// After 400 steps.
    pub(super) fn solve(&self, x: &mut [V3d]) -> usize {
        let mut newton = Newton::new(self);
        let scale: f64 = (0..x.len()).map(|i| self.force(i).norm()).sum();
        for step in 0..400 {
            let direction = newton.direction(self, x);
            let slope: f64 = (0..x.len())
                .map(|i| newton.residual[i].dot(&direction[i]))
                .sum();
            let residual = newton.residual.iter().map(V3d::norm).fold(0.0, f64::max);
            if residual < 1e-10 * scale {
                return step;
            }
            let (before, mut size) = (self.energy(x), 1.0);
            loop {
                let moved: Vec<V3d> = x
                    .iter()
                    .zip(&direction)
                    .map(|(x, d)| x + d * size)
                    .collect();
                let tolerance = 1e-14 * before.abs();
                if self.energy(&moved) <= before + 1e-4 * size * slope + tolerance || size < 1e-9 {
                    x.copy_from_slice(&moved);
                    break;
                }
                size *= 0.5;
            }
        }
        panic!("no equilibrium");
    }
}

/// Linear solver of one Newton step.
struct Newton {
    pattern: Arc<SymmetricPattern>,
    factor: Factor,
    expansion: ElasticExpansion,
    /// Derivative of the energy, zero where held.
    residual: Vec<V3d>,
}

impl Newton {
    fn new(statics: &Statics) -> Self {
        let n = statics.model.vertex_count();
        let blocks = (0..n as u32)
            .map(|i| [i, i])
            .chain(statics.model.pairs().iter().copied());
        let entries = blocks.flat_map(|[i, j]| (0..9).map(move |k| (3 * i + k / 3, 3 * j + k % 3)));
        let pattern = Arc::new(SymmetricPattern::new(3 * n, entries).expect("in range"));
        Self {
            factor: Factor::new(SymbolicFactor::new(pattern.clone()).expect("small")),
            pattern,
            expansion: ElasticExpansion::default(),
            residual: vec![V3d::zeros(); n],
        }
    }
    /// Newton direction at `x`.
    fn direction(&mut self, statics: &Statics, x: &[V3d]) -> Vec<V3d> {
        let (n, e) = (x.len(), &mut self.expansion);
        statics.model.expand(Par::Seq, x, e);
        let mut values = vec![0.0; self.pattern.entries()];
        let diagonal = (0..n as u32).map(|i| [i, i]).zip(&e.diagonal);
        let blocks = diagonal.chain(statics.model.pairs().iter().copied().zip(&e.off_diagonal));
        for ([i, j], block) in blocks {
            for (a, b) in (0..9).map(|k| (k / 3, k % 3)) {
                let held = statics.held[i as usize][a] || statics.held[j as usize][b];
                if !held && (i != j || a >= b) {
                    let (row, column) = (3 * i + a as u32, 3 * j + b as u32);
                    values[self.pattern.slot(row, column).expect("in pattern")] = block[(a, b)];
                }
            }
        }
        for i in 0..n {
            self.residual[i] = e.gradient[i] - statics.force(i);
            for a in 0..3 {
                let slot = self.pattern.diagonal_slot(3 * i + a);
                if statics.held[i][a] {
                    self.residual[i][a] = 0.0;
                    values[slot] = 1.0;
                } else {
                    values[slot] += 1e-9;
                }
            }
        }
        self.factor.refactor(&values).expect("positive definite");
        let mut rhs: Vec<[f64; 3]> = self
            .residual
            .iter()
            .flat_map(|r| [[-r.x, 0.0, 0.0], [-r.y, 0.0, 0.0], [-r.z, 0.0, 0.0]])
            .collect();
        self.factor.solve(&mut rhs);
        (0..n)
            .map(|i| V3d::new(rhs[3 * i][0], rhs[3 * i + 1][0], rhs[3 * i + 2][0]))
            .collect()
    }
}
