//! Walks that are led astray.

use super::{Closest, Part, SurfaceFrame, SurfaceModel};
use crate::math::P3;

/// What was outside the skin a moment ago and seems to be deeper in it than this was led astray, metres.
const ASTRAY: f32 = 0.01;

impl SurfaceModel {
    /// As [`Self::closest_within`], for a point `p` that was outside the skin a moment ago. A wrong `start` leads to the other
    /// side of the trunk, under all of which the point then seems to lie; where that is so, walks from `others` are tried
    /// too, and the nearest skin of all counts. Metres, world.
    pub fn closest_unless_astray(
        &self,
        frame: &SurfaceFrame,
        p: &P3,
        start: u32,
        mask: Part,
        reach: f32,
        others: impl Iterator<Item = u32>,
    ) -> (u32, Result<Closest, f32>) {
        let from = |start: u32| self.closest_within(frame, p, start, mask, reach);
        let walked = from(start);
        if !walked.1.is_ok_and(|c| c.signed < -ASTRAY) {
            return walked;
        }
        let far =
            |found: &(u32, Result<Closest, f32>)| found.1.map_or(f32::INFINITY, |c| c.signed.abs());
        others.map(from).fold(walked, |best, other| {
            if far(&other) < far(&best) {
                other
            } else {
                best
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::surface::tests::two_spheres;
    use super::*;

    #[test]
    fn what_seems_to_lie_deep_in_one_ball_is_found_on_the_other() {
        // Two balls of 5 cm that lie 2 cm in each other, of the same part.
        let (surface, frame, n) = two_spheres(4, 0.05, [0.0, 0.08], [1, 1]);
        let n = n as u32;
        // 2 mm outside the right ball, 22 mm deep in the left one.
        let x = P3::new(0.028, 0.0, 0.0);
        let ask = |x: &P3, start: u32, reach: f32, others: &[u32]| {
            surface.closest_unless_astray(&frame, x, start, 1, reach, others.iter().copied())
        };
        let lost = ask(&x, 0, 0.04, &[]).1.expect("skin");
        assert!(
            (lost.signed + 0.022).abs() < 1e-3 && lost.vertex < n,
            "{lost:?}"
        );
        let (vertex, found) = ask(&x, 0, 0.04, &[1, n + 3, 2]);
        let found = found.expect("skin");
        assert!(
            (found.signed - 0.002).abs() < 1e-3 && vertex >= n && found.vertex == vertex,
            "{found:?}"
        );
        // Where no neighbour knows better, the walk stands.
        assert_eq!(
            ask(&x, 0, 0.04, &[1, 2]).1.map(|c| c.vertex),
            Ok(lost.vertex)
        );
        // 5 mm deep is what contact is for: nobody is asked.
        let shallow = P3::new(-0.045, 0.0, 0.0);
        let none = std::iter::from_fn(|| -> Option<u32> { panic!("asked") });
        let stays = surface
            .closest_unless_astray(&frame, &shallow, 0, 1, 0.04, none)
            .1
            .expect("skin");
        assert!((stays.signed + 0.005).abs() < 1e-3, "{stays:?}");
        // Nor where skin is beyond reach.
        let far = P3::new(-0.3, 0.0, 0.0);
        assert!(ask(&far, 0, 0.04, &[n]).1.is_err());
    }
}
