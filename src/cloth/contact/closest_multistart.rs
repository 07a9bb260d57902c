//! Closest point from several starts, for walks that end on the wrong side of the trunk.

use super::{ClosestPoint, SearchExtent, SurfaceFrame, SurfaceModel};
use tryon_geometry::math::P3;

impl SurfaceModel {
    /// As [`Self::closest_within`], for a point `p` that was outside a step ago.
    ///
    /// A wrong `start` puts the whole trunk above the point. Where the result is implausibly deep, walks from `others`
    /// are tried too and the nearest surface counts.
    pub fn closest_multistart(
        &self,
        frame: &SurfaceFrame,
        p: &P3,
        start: u32,
        extent: SearchExtent,
        others: impl Iterator<Item = u32>,
    ) -> (u32, Result<ClosestPoint, f32>) {
        let from = |start: u32| self.closest_within(frame, p, start, extent);
        let walked = from(start);
        let deep = |c: ClosestPoint| c.signed_distance < -self.settings.distrusted_depth;
        if !walked.1.is_ok_and(deep) {
            return walked;
        }
        let distance = |found: &(u32, Result<ClosestPoint, f32>)| {
            found.1.map_or(f32::INFINITY, |c| c.signed_distance.abs())
        };
        others.map(from).fold(walked, |best, other| {
            if distance(&other) < distance(&best) {
                other
            } else {
                best
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_shapes::two_spheres;
    use super::*;

    #[test]
    fn point_deep_in_one_ball_is_found_outside_the_other() {
        // Two balls of 5 cm and one part that penetrate each other by 2 cm.
        let (surface, frame, n) = two_spheres(4, 0.05, [0.0, 0.08], [1, 1]);
        let n = n as u32;
        // 2 mm outside the right ball, 22 mm deep in the left one.
        let x = P3::new(0.028, 0.0, 0.0);
        let extent = SearchExtent {
            mask: 1,
            reach: 0.04,
        };
        let query = |x: &P3, others: &[u32]| {
            surface.closest_multistart(&frame, x, 0, extent, others.iter().copied())
        };
        let near = |c: &ClosestPoint, d: f32| (c.signed_distance - d).abs() < 1e-3;
        let lost = query(&x, &[]).1.expect("skin");
        assert!(near(&lost, -0.022) && lost.vertex < n, "{lost:?}");
        let (vertex, found) = query(&x, &[1, n + 3, 2]);
        let found = found.expect("skin");
        assert!(
            near(&found, 0.002) && vertex >= n && found.vertex == vertex,
            "{found:?}"
        );
        // Without a better start the walk stands.
        assert_eq!(query(&x, &[1, 2]).1.map(|c| c.vertex), Ok(lost.vertex));
        // Plausible depth: the other starts are not evaluated.
        let shallow = P3::new(-0.045, 0.0, 0.0);
        let none = std::iter::from_fn(|| -> Option<u32> { panic!("evaluated") });
        let stays = surface.closest_multistart(&frame, &shallow, 0, extent, none);
        assert!(near(&stays.1.expect("skin"), -0.005));
        assert!(
            query(&P3::new(-0.3, 0.0, 0.0), &[n]).1.is_err(),
            "beyond reach"
        );
    }
}
