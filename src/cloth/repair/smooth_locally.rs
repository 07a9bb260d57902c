//! Local smoothing: cloth that stays intersected is drawn to the mean of its neighbours and falls into other folds.

use super::untangler::Untangler;
use crate::math::V3d;

/// Smoothing iterations; more flatten folds beyond the intersection.
const ITERATIONS: usize = 4;

impl Untangler {
    /// Moves `movable` vertices within some rings of the marked ones half-way to the mean of their neighbours, four times.
    pub(crate) fn smooth_locally(
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
        for _ in 0..ITERATIONS {
            let mut sum = vec![(V3d::zeros(), 0.0); x.len()];
            for e in edges {
                for [a, b] in [[e[0], e[1]], [e[1], e[0]]].map(|e| e.map(|v| v as usize)) {
                    if marked[a] {
                        sum[a].0 += x[b];
                        sum[a].1 += 1.0;
                    }
                }
            }
            for v in (0..x.len()).filter(|v| marked[*v] && movable(*v) && sum[*v].1 > 0.0) {
                x[v] = (x[v] + sum[v].0 / sum[v].1) * 0.5;
            }
        }
    }
}
