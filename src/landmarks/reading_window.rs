//! Readings of registered depth in a square around a landmark.

use std::ops::RangeInclusive;
use tryon_geometry::camera::DepthImage;
use tryon_geometry::math::order_statistics::median;

/// Most pixels from a square's middle to its side: a person who fills a picture of 4000 pixels needs no more.
const MOST_RADIUS: f32 = 32.0;

/// Square in a registered depth image, within the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ReadingWindow {
    /// First and last column, first and last row.
    sides: [[i32; 2]; 2],
}

impl ReadingWindow {
    /// Square of `radius` pixels around a place; `None` for a place beyond the picture.
    pub(crate) fn around(image: &DepthImage, pixel: [f32; 2], radius: f32) -> Option<Self> {
        let size = [image.width(), image.height()];
        let reach = radius.clamp(0.0, MOST_RADIUS);
        let mut sides = [[0; 2]; 2];
        for ((side, centre), size) in sides.iter_mut().zip(pixel).zip(size) {
            let centre = centre.round();
            if !(0.0..size as f32).contains(&centre) {
                return None;
            }
            *side = [(centre - reach).max(0.0) as i32, (centre + reach) as i32];
            side[1] = side[1].min(size as i32 - 1);
        }
        Some(Self { sides })
    }

    /// Median of the readings within a range, metres, if they are at least a share of the square's pixels.
    pub(crate) fn median(
        &self,
        image: &DepthImage,
        range: RangeInclusive<f64>,
        share: f32,
    ) -> Option<f64> {
        let [[left, right], [upper, lower]] = self.sides;
        let mut readings: Vec<f64> = (upper..=lower)
            .flat_map(|row| (left..=right).map(move |column| image.at(column, row)))
            .filter(|reading| *reading > 0)
            .map(|reading| f64::from(reading) * 1e-3)
            .filter(|reading| range.contains(reading))
            .collect();
        let pixels = (right - left + 1) * (lower - upper + 1);
        let is_enough = readings.len() as f32 >= share * pixels as f32;
        median(&mut readings).filter(|_| is_enough)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_of_the_wanted_range_count() {
        let mut image = DepthImage::empty(20, 20);
        for (k, reading) in image.data_mut().iter_mut().enumerate() {
            *reading = match k % 20 {
                0..10 => 1000,
                10..13 => 3000,
                _ => 0,
            };
        }
        let window = ReadingWindow::around(&image, [9.2, 10.0], 4.0).expect("inside");
        let median = |range, share| window.median(&image, range, share);
        // Five columns at 1 m, three at 3 m, one without reading.
        assert_eq!(median(0.5..=1.5, 0.5), Some(1.0));
        assert_eq!(median(2.0..=4.0, 0.3), Some(3.0));
        assert_eq!(median(2.0..=4.0, 0.4), None);
        assert_eq!(median(1.2..=2.0, 0.0), None);
        for beyond in [[-1.0, 5.0], [5.0, 20.0], [f32::NAN, 5.0]] {
            assert_eq!(ReadingWindow::around(&image, beyond, 4.0), None);
        }
        assert!(ReadingWindow::around(&image, [0.0, 19.0], f32::INFINITY).is_some());
        assert_eq!(
            ReadingWindow::around(&DepthImage::default(), [0.0, 0.0], 1.0),
            None
        );
    }
}
