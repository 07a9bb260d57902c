//! Pixels without depth, by part of the picture.

use serde::Serialize;
use std::ops::Range;
use tryon_geometry::camera::DepthImage;

/// Shares of the pixels without depth, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HoleShares {
    /// Of the middle: half of the columns, half of the rows, where the person stands.
    pub middle: f64,
    /// Of the lowest quarter of the rows, half of the columns: the floor before the person.
    pub lower: f64,
    /// Of the whole picture.
    pub whole: f64,
}

/// Columns and rows of the lower part.
pub(crate) fn lower_part([width, height]: [usize; 2]) -> [Range<usize>; 2] {
    [width / 4..width - width / 4, height - height / 4..height]
}

impl HoleShares {
    /// Shares of one image; 1 where a part has no pixel.
    pub fn of(depth: &DepthImage) -> Self {
        let size = [depth.width() as usize, depth.height() as usize];
        let [width, height] = size;
        let middle = [
            width / 4..width - width / 4,
            height / 4..height - height / 4,
        ];
        Self {
            middle: share(depth, middle),
            lower: share(depth, lower_part(size)),
            whole: share(depth, [0..width, 0..height]),
        }
    }

    /// Mean of several images; `None` of none.
    pub(crate) fn mean(of: &[Self]) -> Option<Self> {
        let mean = |part: fn(&Self) -> f64| {
            let sum: f64 = of.iter().map(part).sum();
            sum / of.len() as f64
        };
        (!of.is_empty()).then(|| Self {
            middle: mean(|s| s.middle),
            lower: mean(|s| s.lower),
            whole: mean(|s| s.whole),
        })
    }
}

fn share(depth: &DepthImage, [columns, rows]: [Range<usize>; 2]) -> f64 {
    let (pixels, width) = (columns.len() * rows.len(), depth.width() as usize);
    if pixels == 0 {
        return 1.0;
    }
    let row = |v: usize| &depth.data()[v * width + columns.start..v * width + columns.end];
    let holes = |v: usize| row(v).iter().filter(|d| **d == 0).count();
    rows.map(holes).sum::<usize>() as f64 / pixels as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Holes by column and row of a picture of 40 × 20.
    fn shares(is_hole: impl Fn(usize, usize) -> bool) -> HoleShares {
        let pixels = (0..800).map(|i| 1500 * u16::from(!is_hole(i % 40, i / 40)));
        HoleShares::of(&DepthImage::new(40, 20, pixels.collect()).expect("800"))
    }

    #[test]
    fn shares_are_those_that_were_punched() {
        let none = HoleShares::default();
        assert_eq!(shares(|_, _| false), none);
        let checked = shares(|u, v| (u + v) % 2 == 0);
        assert_eq!([checked.middle, checked.lower, checked.whole], [0.5; 3]);
        // Rows 15 to 19 are the lower part; none of them is in the middle, 5 to 14.
        let floor = shares(|_, v| v >= 15);
        assert_eq!([floor.middle, floor.lower, floor.whole], [0.0, 1.0, 0.25]);
        // Columns 0 to 9 are in neither part.
        let side = shares(|u, _| u < 10);
        assert_eq!([side.middle, side.lower, side.whole], [0.0, 0.0, 0.25]);
    }

    #[test]
    fn means_are_over_images_and_nothing_is_all_holes() {
        let halves = HoleShares::mean(&[shares(|_, _| true), shares(|_, _| false)]);
        assert_eq!(halves.expect("two").middle, 0.5);
        assert_eq!(HoleShares::mean(&[]), None);
        assert_eq!(HoleShares::of(&DepthImage::default()).middle, 1.0);
    }
}
