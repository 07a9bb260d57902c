//! Local smoothing: cloth that stays intersected is drawn to the mean of its neighbours and falls into other folds.

use super::untangler::Untangler;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Csr;
use tryon_geometry::mesh::smoothing::mean;

/// Smoothing iterations; more flatten folds beyond the intersection.
const ITERATIONS: usize = 4;

impl Untangler {
    /// Moves `movable` vertices within some rings of the marked ones half-way to the mean of their neighbours, four times.
    pub fn smooth_locally(
        &self,
        x: &mut [V3d],
        mut marked: Vec<bool>,
        movable: impl Fn(usize) -> bool,
        rings: usize,
    ) {
        let edges = self.finder.edges();
        for _ in 0..rings {
            self.grow(&mut marked);
        }
        let pairs: Vec<(u32, u32)> = edges
            .iter()
            .flat_map(|&[a, b]| [(a, b), (b, a)])
            .filter(|(a, _)| marked[*a as usize])
            .collect();
        let neighbours = Csr::from_pairs(x.len(), &pairs);
        for _ in 0..ITERATIONS {
            let halfway = |v: usize| {
                let middle = mean(neighbours.row(v).iter().map(|a| &x[*a as usize]))?;
                Some((v, (x[v] + middle) * 0.5))
            };
            let movable = (0..x.len()).filter(|v| marked[*v] && movable(*v));
            let moved: Vec<_> = movable.filter_map(halfway).collect();
            moved.into_iter().for_each(|(v, to)| x[v] = to);
        }
    }
}
