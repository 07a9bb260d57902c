//! Coarse space of a two-level preconditioner: patches of vertices that move by affine functions of two coordinates.
//!
//! Each patch has three shape functions (1 and its two principal coordinates) for each of x, y, z. A flat patch has all its
//! rigid motions to first order among them, so what stays for the fine level lives within a patch.

use super::{
    BlockMatrix, BlockPattern, Factor, LinearError, SymbolicFactor, pattern::SymmetricPattern,
};
use crate::par::{Par, for_chunks, map_into};
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;
use std::sync::Arc;

/// Shape functions of a patch.
const FUNCTIONS: usize = 3;
/// Unknowns of a patch.
const LOADS: usize = 3 * FUNCTIONS;
/// Patches that one thread takes at a time.
const PATCHES: usize = 32;
/// Variance of a coordinate beside the first's below which it counts as constant.
const FLAT: f64 = 1e-4;

/// Patches, their shape functions and the factored coarse matrix.
#[derive(Debug, Default)]
pub struct CoarseSpace {
    /// Patch of each vertex; `u32::MAX` for those of the fine level alone.
    patch: Vec<u32>,
    patches: usize,
    /// Values of the shape functions at each vertex.
    shapes: Vec<[f64; FUNCTIONS]>,
    /// Vertices of each patch.
    members: Vec<Vec<u32>>,
    factor: Option<Factor>,
    /// Right-hand side of the coarse system.
    loads: Vec<f64>,
}

impl CoarseSpace {
    /// Grows patches of `size` vertices over the graph of a pattern. Vertices without a neighbour belong to none.
    pub fn new(pattern: &BlockPattern, size: usize) -> Self {
        let n = pattern.size();
        let mut space = Self {
            patch: vec![u32::MAX; n],
            shapes: vec![[0.0; FUNCTIONS]; n],
            ..Self::default()
        };
        // Each patch begins beside the last ones, so that no small ones are left between.
        let mut seeds: VecDeque<u32> = VecDeque::new();
        let mut next = 0;
        loop {
            let beside = std::iter::from_fn(|| seeds.pop_front());
            let seed = beside.into_iter().find(|s| space.is_free(*s));
            let seed = match seed {
                Some(seed) => seed,
                None => {
                    while next < n
                        && !(space.is_free(next as u32) && pattern.neighbours(next).len() > 1)
                    {
                        next += 1;
                    }
                    if next == n {
                        break;
                    }
                    next as u32
                }
            };
            space.grow(pattern, seed, size, &mut seeds);
        }
        space.members.resize(space.patches, Vec::new());
        for (patch, v) in space.patch.iter().zip(0..) {
            if let Some(members) = space.members.get_mut(*patch as usize) {
                members.push(v);
            }
        }
        space
    }

    fn is_free(&self, vertex: u32) -> bool {
        self.patch[vertex as usize] == u32::MAX
    }

    fn grow(&mut self, pattern: &BlockPattern, seed: u32, size: usize, seeds: &mut VecDeque<u32>) {
        let number = self.patches as u32;
        let mut queue = VecDeque::from([seed]);
        let mut count = 0;
        while count < size {
            let Some(v) = queue.pop_front() else { break };
            if !self.is_free(v) {
                continue;
            }
            self.patch[v as usize] = number;
            count += 1;
            let beside = pattern.neighbours(v as usize).iter();
            queue.extend(beside.filter(|w| self.patch[**w as usize] == u32::MAX));
        }
        seeds.extend(queue);
        self.patches += 1;
    }

    /// Fits the shape functions to positions (m) and factors the coarse form of the sum of matrices.
    ///
    /// # Errors
    /// A coarse matrix that is not positive definite.
    pub fn update(
        &mut self,
        par: Par,
        positions: &[Vector3<f64>],
        matrices: &[&BlockMatrix],
    ) -> Result<(), LinearError> {
        self.fit(positions);
        let mut sum = self.coarse_matrix(par, matrices)?;
        for row in 0..sum.pattern().size() {
            // A function that vanishes, as the slope of a patch of one vertex, stays without effect.
            if sum.diagonal(row).trace() <= 0.0 {
                let slot = sum.pattern().diagonal_slot(row);
                *sum.block_mut(slot) = Matrix3::identity();
            }
        }
        let (pattern, values): (SymmetricPattern, Vec<f64>) = sum.to_scalar()?;
        let same = self.factor.take();
        let mut factor = match same {
            Some(factor) if *factor.pattern() == pattern => factor,
            _ => Factor::new(SymbolicFactor::new(Arc::new(pattern))?),
        };
        factor.refactor(&values)?;
        self.factor = Some(factor);
        Ok(())
    }

    /// Adds the coarse solution for the residual `r` to `z`; the bits do not depend on the threads.
    pub fn add(&mut self, par: Par, r: &[Vector3<f64>], z: &mut [Vector3<f64>]) {
        let Some(factor) = &mut self.factor else {
            return;
        };
        let (members, shapes) = (&self.members, &self.shapes);
        self.loads.resize(LOADS * self.patches, 0.0);
        for_chunks(par, &mut self.loads, PATCHES * LOADS, |start, chunk| {
            for (k, loads) in chunk.chunks_exact_mut(LOADS).enumerate() {
                loads.fill(0.0);
                for v in &members[start / LOADS + k] {
                    let (r, shapes) = (&r[*v as usize], &shapes[*v as usize]);
                    for (loads, shape) in loads.chunks_exact_mut(3).zip(shapes) {
                        loads.iter_mut().zip(r).for_each(|(l, r)| *l += shape * r);
                    }
                }
            }
        });
        factor.solve_vector(&mut self.loads);
        let (patch, loads) = (&self.patch, &self.loads);
        for_chunks(par, z, PATCHES * LOADS, |start, chunk| {
            for (k, z) in chunk.iter_mut().enumerate() {
                // Vertices of the fine level alone have no patch, those beyond all patches no entry.
                let first = patch.get(start + k).map(|p| LOADS * *p as usize);
                let own = first.and_then(|f| loads.get(f..f + LOADS));
                for (loads, shape) in own
                    .into_iter()
                    .flat_map(|l| l.chunks_exact(3).zip(&shapes[start + k]))
                {
                    *z += Vector3::from_column_slice(loads) * *shape;
                }
            }
        });
    }

    /// Shape functions: 1, and the two principal coordinates of each patch in parts of their deviation.
    fn fit(&mut self, positions: &[Vector3<f64>]) {
        let mut means = vec![(Vector3::zeros(), 0.0); self.patches];
        for (patch, x) in self.patch.iter().zip(positions) {
            if let Some(mean) = means.get_mut(*patch as usize) {
                mean.0 += x;
                mean.1 += 1.0;
            }
        }
        let means: Vec<Vector3<f64>> = means.iter().map(|(sum, n)| sum / *n).collect();
        let mut spreads = vec![Matrix3::zeros(); self.patches];
        for (patch, x) in self.patch.iter().zip(positions) {
            if let Some(spread) = spreads.get_mut(*patch as usize) {
                let apart = x - means[*patch as usize];
                *spread += apart * apart.transpose();
            }
        }
        let axes: Vec<[Vector3<f64>; 2]> = spreads.iter().map(principal_axes).collect();
        for ((patch, x), shapes) in self.patch.iter().zip(positions).zip(&mut self.shapes) {
            if let Some(axes) = axes.get(*patch as usize) {
                let apart = x - means[*patch as usize];
                *shapes = [1.0, apart.dot(&axes[0]), apart.dot(&axes[1])];
            }
        }
    }

    /// Pᵀ (Σ A) P, three rows of blocks a patch.
    fn coarse_matrix(
        &self,
        par: Par,
        matrices: &[&BlockMatrix],
    ) -> Result<BlockMatrix, LinearError> {
        let f = FUNCTIONS as u32;
        let mut rows: Vec<PatchRow> = Vec::new();
        map_into(par, self.patches, PATCHES, &mut rows, |p| {
            let mut row = PatchRow::default();
            for m in matrices {
                self.add_row(m, p, &mut row);
            }
            row
        });
        let pairs = rows.iter().enumerate().flat_map(|(a, row)| {
            row.iter().flat_map(move |(b, _)| {
                (0..f).flat_map(move |i| (0..f).map(move |j| (f * a as u32 + i, f * b + j)))
            })
        });
        let size = FUNCTIONS * self.patches;
        let mut coarse = BlockMatrix::zeros(Arc::new(BlockPattern::new(size, pairs)?));
        for (own, row) in rows.iter().enumerate() {
            for (other, blocks) in row {
                for (i, blocks) in blocks.iter().enumerate() {
                    // The functions of a patch are neighbours in every row of the pattern.
                    let first = f * own as u32 + i as u32;
                    let Some(slot) = coarse.pattern().slot(first, f * other) else {
                        continue;
                    };
                    for (j, block) in blocks.iter().enumerate() {
                        *coarse.block_mut(slot + j) += block;
                    }
                }
            }
        }
        Ok(coarse)
    }

    /// Adds the rows of the members of a patch.
    fn add_row(&self, m: &BlockMatrix, patch: usize, row: &mut PatchRow) {
        let members = self.members[patch].iter().map(|v| *v as usize);
        for vertex in members.filter(|v| *v < m.pattern().size()) {
            let weights = &self.shapes[vertex];
            for (column, block) in m.row_blocks(vertex) {
                let Some(other) = self.patch.get(column as usize).filter(|o| **o != u32::MAX)
                else {
                    continue;
                };
                let at = row.iter().position(|(o, _)| o == other);
                let at = at.unwrap_or_else(|| {
                    row.push((*other, Default::default()));
                    row.len() - 1
                });
                for (weight, sums) in weights.iter().zip(&mut row[at].1) {
                    for (shape, sum) in self.shapes[column as usize].iter().zip(sums) {
                        *sum += block * (weight * shape);
                    }
                }
            }
        }
    }
}

/// Row of a patch in the coarse matrix: the patches that it meets, and a block for each pair of shape functions.
type PatchRow = Vec<(u32, [[Matrix3<f64>; FUNCTIONS]; FUNCTIONS])>;

/// The two principal axes over their standard deviations; zero where a patch has no extent.
fn principal_axes(spread: &Matrix3<f64>) -> [Vector3<f64>; 2] {
    let eigen = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let largest = eigen.eigenvalues[order[0]];
    [order[0], order[1]].map(|k| {
        let variance = eigen.eigenvalues[k];
        let axis: Vector3<f64> = eigen.eigenvectors.column(k).into();
        if variance > FLAT * largest && variance > 0.0 {
            axis / variance.sqrt()
        } else {
            Vector3::zeros()
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{BlockJacobi, CgAccuracy, CgSettings, TwoLevel, conjugate_gradient};

    /// Springs along a grid of n × n vertices, held softly; positions of its vertices.
    fn grid(n: usize) -> (BlockMatrix, Vec<Vector3<f64>>) {
        let id = |i: usize, j: usize| (n * j + i) as u32;
        let along = (0..n).flat_map(|j| (1..n).map(move |i| (id(i - 1, j), id(i, j))));
        let across = (0..n).flat_map(|j| (1..n).map(move |i| (id(j, i - 1), id(j, i))));
        let edges: Vec<_> = along.chain(across).collect();
        let pattern = BlockPattern::new(n * n, edges.iter().copied()).expect("pattern");
        let mut matrix = BlockMatrix::zeros(Arc::new(pattern));
        let mut add = |a: u32, b: u32, k: f64| {
            let slot = matrix.pattern().slot(a, b).expect("in pattern");
            *matrix.block_mut(slot) += Matrix3::from_diagonal_element(k);
        };
        for (a, b) in edges {
            add(a, a, 1.0);
            add(b, b, 1.0);
            add(a, b, -1.0);
            add(b, a, -1.0);
        }
        (0..(n * n) as u32).for_each(|v| add(v, v, 1e-3));
        let at = |k: usize| Vector3::new((k % n) as f64, (k / n) as f64, 0.0);
        (matrix, (0..n * n).map(at).collect())
    }

    #[test]
    fn two_levels_solve_the_same_system_in_fewer_iterations() {
        let (matrix, x) = grid(40);
        let right: Vec<_> = (0..x.len())
            .map(|k| Vector3::new(1.0, (k as f64).sin(), k as f64 * 1e-3))
            .collect();
        let apply = |x: &[Vector3<f64>], y: &mut [Vector3<f64>]| {
            y.fill(Vector3::zeros());
            matrix.multiply_add(Par::Seq, x, y);
        };
        let settings = CgSettings {
            accuracy: CgAccuracy::Residual(1e-9),
            iterations: 1000,
            par: Par::Seq,
        };
        let mut one = vec![Vector3::zeros(); x.len()];
        let mut jacobi = BlockJacobi::new(Par::Seq, &[&matrix]);
        let alone = conjugate_gradient(apply, &mut jacobi, &right, &mut one, settings);
        let mut coarse = CoarseSpace::new(matrix.pattern(), 48);
        coarse
            .update(Par::Seq, &x, &[&matrix])
            .expect("positive definite");
        let mut two = vec![Vector3::zeros(); x.len()];
        let mut levels = TwoLevel::new(BlockJacobi::new(Par::Seq, &[&matrix]), &mut coarse);
        let both = conjugate_gradient(apply, &mut levels, &right, &mut two, settings);
        assert!(2 * both.iterations < alone.iterations, "{both:?} {alone:?}");
        let apart = one.iter().zip(&two).map(|(a, b)| (a - b).norm());
        let size = one.iter().map(|a| a.norm()).fold(0.0, f64::max);
        assert!(apart.fold(0.0, f64::max) < 1e-6 * size);
    }

    #[test]
    fn lone_vertices_belong_to_no_patch_and_add_nothing() {
        let pattern = BlockPattern::new(3, [(0, 1)]).expect("pattern").extended(2);
        let mut matrix = BlockMatrix::zeros(Arc::new(pattern));
        for v in 0..5 {
            let slot = matrix.pattern().diagonal_slot(v);
            *matrix.block_mut(slot) = Matrix3::identity();
        }
        let mut coarse = CoarseSpace::new(matrix.pattern(), 48);
        let x = vec![Vector3::zeros(); 5];
        coarse
            .update(Par::Seq, &x, &[&matrix])
            .expect("a patch without extent");
        let mut z = vec![Vector3::zeros(); 5];
        coarse.add(Par::Seq, &[Vector3::new(1.0, 2.0, 3.0); 5], &mut z);
        assert!((z[0] - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-12, "{z:?}");
        assert!(z[2..].iter().all(|z| *z == Vector3::zeros()), "{z:?}");
    }
}
