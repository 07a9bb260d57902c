//! Square of a picture, turned with the person in it.

/// Side of the region over the radius of the circle around the person: MediaPipe's margin, which the network was trained with.
const MARGIN: f32 = 1.25;

/// Square in a picture whose upper side lies at the person's head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PersonRegion {
    /// Middle: column and row, pixels, centres at integers; between the hips of a person who is followed.
    pub centre: [f32; 2],
    /// Side, pixels.
    pub side: f32,
    /// Roll of the person, clockwise in the picture, radians: 0 upright, π upside down.
    pub roll: f32,
}

impl PersonRegion {
    /// Region of a person from the middle between the hips, and a point above the head by whom a circle around the middle
    /// holds the whole body; both column and row, pixels. `None` for points that are not apart.
    pub fn around(hips: [f32; 2], reach: [f32; 2]) -> Option<Self> {
        let [dx, dy] = [reach[0] - hips[0], reach[1] - hips[1]];
        let side = 2.0 * MARGIN * dx.hypot(dy);
        let is_usable = side >= 1.0 && side.is_finite() && hips.iter().all(|c| c.is_finite());
        is_usable.then(|| Self {
            centre: hips,
            side,
            roll: dx.atan2(-dy),
        })
    }

    /// The whole of a picture of `columns` × `rows`, letterboxed, as seen after `quarters` quarter turns of the head,
    /// clockwise.
    pub(crate) fn whole([columns, rows]: [u32; 2], quarters: usize) -> Self {
        Self {
            centre: [columns, rows].map(|n| 0.5 * (n as f32 - 1.0)),
            side: columns.max(rows) as f32,
            roll: std::f32::consts::FRAC_PI_2 * (quarters % 4) as f32,
        }
    }

    /// Pixel at a place of the region: columns and rows of the upright person, shares of the side from its middle, −½ to ½.
    pub fn pixel(&self, place: [f32; 2]) -> [f32; 2] {
        let [x, y] = self.direction(place);
        [
            self.centre[0] + self.side * x,
            self.centre[1] + self.side * y,
        ]
    }

    /// Direction of the picture that a direction of the upright person has.
    pub fn direction(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let (s, c) = self.roll.sin_cos();
        [x * c - y * s, x * s + y * c]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::{FRAC_PI_2, PI};

    fn assert_near(got: [f32; 2], want: [f32; 2]) {
        let far = (got[0] - want[0]).hypot(got[1] - want[1]);
        assert!(far < 1e-3, "{got:?}, not {want:?}");
    }

    #[test]
    fn a_region_turns_with_the_person() {
        for (reach, roll) in [
            ([100.0, 150.0], 0.0),
            ([150.0, 200.0], FRAC_PI_2),
            ([100.0, 250.0], PI),
            ([50.0, 200.0], -FRAC_PI_2),
        ] {
            let region = PersonRegion::around([100.0, 200.0], reach).expect("points apart");
            assert!((region.roll - roll).sin().abs() < 1e-6, "{region:?}");
            assert_eq!(region.side, 125.0);
            // A share of 0.4 of the side upwards is the point itself.
            assert_near(region.pixel([0.0, -0.4]), reach);
        }
        for reach in [[100.0, 200.0], [f32::NAN, 0.0], [f32::INFINITY, 0.0]] {
            assert_eq!(PersonRegion::around([100.0, 200.0], reach), None);
        }
    }

    /// A picture of 40 × 20 has bars of 10 pixels above and below.
    #[test]
    fn the_whole_picture_is_letterboxed() {
        let upright = PersonRegion::whole([40, 20], 0);
        assert_near(upright.pixel([-0.5, -0.5]), [-0.5, -10.5]);
        assert_near(upright.pixel([0.5, 0.25]), [39.5, 19.5]);
        let fallen = PersonRegion::whole([40, 20], 1);
        // The head of a person turned clockwise by a quarter points to the picture's right.
        assert_near(fallen.pixel([0.0, -0.5]), [39.5, 9.5]);
    }
}
