//! A kd-tree of points, built once and asked often.

use crate::math::P3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// Points in space, ready for nearest-neighbour queries.
pub struct PointTree {
    tree: Option<ImmutableKdTree<f32, 3>>,
}

impl PointTree {
    /// Builds the tree; points that are not finite make it empty.
    pub fn new(points: &[P3]) -> Self {
        let entries: Vec<[f32; 3]> = points.iter().map(|p| [p.x, p.y, p.z]).collect();
        let usable = !entries.is_empty() && entries.iter().flatten().all(|c| c.is_finite());
        Self {
            tree: usable
                .then(|| ImmutableKdTree::new_from_slice(&entries).ok())
                .flatten(),
        }
    }
    /// Index and squared distance of the point nearest to `query`, if it is nearer than `radius`.
    pub fn nearest(&self, query: &P3, radius: f32) -> Option<(usize, f32)> {
        let found = self
            .tree
            .as_ref()?
            .query(&[query.x, query.y, query.z])
            .nearest_one::<SquaredEuclidean<f32>>()
            .execute();
        (found.distance < radius * radius).then_some((found.item as usize, found.distance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spatial::nearest_brute_force;
    use rand::{Rng, SeedableRng};

    #[test]
    fn agrees_with_brute_force() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(3);
        let mut point = || P3::new(rng.random(), rng.random(), rng.random());
        let points: Vec<P3> = (0..700).map(|_| point()).collect();
        let tree = PointTree::new(&points);
        for _ in 0..300 {
            let q = point();
            for radius in [0.02, 0.1, 2.0] {
                let (a, b) = (
                    tree.nearest(&q, radius),
                    nearest_brute_force(&points, &q, radius),
                );
                assert_eq!(a.map(|x| x.0), b.map(|x| x.0));
            }
        }
    }

    #[test]
    fn degenerate_clouds_answer_none_or_a_copy() {
        assert!(PointTree::new(&[]).nearest(&P3::origin(), 1.0).is_none());
        assert!(
            PointTree::new(&[P3::new(f32::NAN, 0.0, 0.0)])
                .nearest(&P3::origin(), 1.0)
                .is_none()
        );
        let same = vec![P3::new(0.5, 0.5, 0.5); 500];
        assert!(PointTree::new(&same).nearest(&P3::origin(), 2.0).is_some());
    }
}
