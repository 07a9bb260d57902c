//! Border of the person in a change image: the strongest step down along a line that leads out of the person.

use super::change::GreyImage;
use nalgebra::{Point2, Vector2};

/// Search for a border along a line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BorderSearch {
    /// Distance searched to both sides (pixels).
    pub(crate) reach: usize,
    /// Pixels averaged on each side of a step.
    pub(crate) side: usize,
    /// Least step (levels).
    pub(crate) contrast: f32,
}

/// Largest change outside of the border, share of that inside: the scene itself may change, by a shadow.
const MOST_OUTSIDE: f32 = 0.5;

impl BorderSearch {
    /// Signed distance (pixels) along the unit vector `outward` from `at` to the border; `None` if there is none.
    pub(crate) fn find(
        &self,
        image: &GreyImage,
        at: Point2<f64>,
        outward: Vector2<f64>,
    ) -> Option<f64> {
        let is_inside = at.x >= 0.0
            && at.y >= 0.0
            && at.x <= (image.width - 1) as f64
            && at.y <= (image.height - 1) as f64;
        if !is_inside {
            return None;
        }
        let (at, outward) = (at.cast::<f32>(), outward.cast::<f32>());
        let (side, first) = (self.side, -((self.reach + self.side) as f32));
        let count = 2 * (self.reach + side) + 1;
        let profile: Vec<f32> = (0..count)
            .map(|i| {
                let p = at + outward * (first + i as f32);
                image.sample(p.x, p.y)
            })
            .collect();

        // Middle of `side` samples before and after sample i.
        let step = |i: usize| {
            let inner: f32 = profile[i - side..i].iter().sum();
            let outer: f32 = profile[i + 1..=i + side].iter().sum();
            [inner / side as f32, outer / side as f32]
        };
        let best = (side..count - side).max_by(|a, b| {
            let size = |i: usize| step(i)[0] - step(i)[1];
            size(*a).total_cmp(&size(*b))
        })?;
        let [inner, outer] = step(best);
        if inner - outer < self.contrast || outer > MOST_OUTSIDE * inner {
            return None;
        }
        // The border leaves as much of the person inside as the samples around it sum up to.
        let share = |c: &f32| ((c - outer) / (inner - outer)).clamp(0.0, 1.0);
        let inside: f32 = profile[best - side..=best + side].iter().map(share).sum();
        let start = first + (best - side) as f32 - 0.5;
        Some(f64::from(start + inside))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A half plane at 0.3 + 20 columns with a soft edge, and a shadow beside it.
    #[test]
    fn the_border_is_found_to_a_tenth_of_a_pixel() {
        let edge = 20.3;
        let data = (0..40 * 60).map(|i| {
            let cover = (edge + 0.5 - f64::from(i % 60)).clamp(0.0, 1.0);
            (20.0 + 80.0 * cover) as u8
        });
        let image = GreyImage {
            width: 60,
            height: 40,
            data: data.collect(),
        };
        let search = BorderSearch {
            reach: 8,
            side: 3,
            contrast: 14.0,
        };
        for u in [14.0, 17.6, 20.0, 24.9] {
            let s = search.find(&image, Point2::new(u, 20.0), Vector2::x());
            assert!((s.expect("an edge") - (edge - u)).abs() < 0.1, "{u}: {s:?}");
        }
        // The other way it is a step up; far away there is none.
        let none = [
            search.find(&image, Point2::new(20.0, 20.0), -Vector2::x()),
            search.find(&image, Point2::new(45.0, 20.0), Vector2::x()),
            search.find(&image, Point2::new(-1.0, 20.0), Vector2::x()),
        ];
        assert_eq!(none, [None; 3]);
    }
}
