//! Colours of the pixels without depth: sunlight washes a picture out, dark floors swallow the projected light.
//!
//! Infrared images, which would show sunlight directly, are not part of a frame.

use crate::holes::lower_part;
use serde::Serialize;
use tryon_geometry::camera::{ColorImage, DepthImage, RgbdFrame};

/// Least of the three channels from which a colour is washed out.
const WASHED_OUT: u8 = 245;

/// Colours in holes and elsewhere, of colour that is registered to depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HoleColors {
    /// Share of the holes whose colour is washed out.
    pub washed_out: f64,
    /// The same of the pixels with depth.
    pub washed_out_elsewhere: f64,
    /// Mean brightness of the holes in the lower part, 0 to 255; 0 without any.
    pub lower_brightness: f64,
}

/// Sums over frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct HoleColorSums {
    /// Pixels and washed-out ones: with depth, without.
    pixels: [u64; 2],
    washed_out: [u64; 2],
    lower: u64,
    brightness: u64,
}

impl HoleColorSums {
    /// Adds a frame whose colour has the pixels of its depth; others add nothing.
    pub(crate) fn add(&mut self, frame: &RgbdFrame) {
        let depth = &frame.depth;
        let Some(color) = &frame.color else { return };
        if (color.width(), color.height()) != (depth.width(), depth.height()) {
            return;
        }
        let (pixels, _) = color.data().as_chunks::<3>();
        for (pixel, reading) in pixels.iter().zip(depth.data()) {
            let is_hole = usize::from(*reading == 0);
            self.pixels[is_hole] += 1;
            let is_washed_out = pixel.iter().all(|c| *c >= WASHED_OUT);
            self.washed_out[is_hole] += u64::from(is_washed_out);
        }
        self.add_lower(depth, color);
    }

    fn add_lower(&mut self, depth: &DepthImage, color: &ColorImage) {
        let [columns, rows] = lower_part([depth.width() as usize, depth.height() as usize]);
        for v in rows {
            for u in columns.clone() {
                if depth.at(u as i32, v as i32) == 0 {
                    let [r, g, b] = color.at(u as u32, v as u32).map(u64::from);
                    self.lower += 1;
                    self.brightness += (r + g + b) / 3;
                }
            }
        }
    }

    /// Shares; `None` where no frame had registered colour.
    pub(crate) fn colors(&self) -> Option<HoleColors> {
        if self.pixels == [0; 2] {
            return None;
        }
        let share = |k: usize| self.washed_out[k] as f64 / self.pixels[k].max(1) as f64;
        Some(HoleColors {
            washed_out: share(1),
            washed_out_elsewhere: share(0),
            lower_brightness: self.brightness as f64 / self.lower.max(1) as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_of_holes_and_of_the_rest_are_told_apart() {
        // A washed-out strip above without depth, a dark one below without depth.
        let (mut depth, mut color) = (vec![1500; 1600], vec![120; 4800]);
        for i in 0..400 {
            (depth[i], depth[1599 - i]) = (0, 0);
            color[3 * i..3 * i + 3].fill(255);
            color[4797 - 3 * i..4800 - 3 * i].fill(30);
        }
        let frame = RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: DepthImage::new(40, 40, depth).expect("1600"),
            color: ColorImage::new(40, 40, color).ok(),
        };
        let mut sums = HoleColorSums::default();
        sums.add(&frame);
        let got = sums.colors().expect("registered");
        let want = HoleColors {
            washed_out: 0.5,
            washed_out_elsewhere: 0.0,
            lower_brightness: 30.0,
        };
        assert_eq!(got, want);
    }

    #[test]
    fn colour_of_another_size_tells_nothing() {
        let mut sums = HoleColorSums::default();
        sums.add(&RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: DepthImage::empty(4, 4),
            color: Some(ColorImage::filled(8, 8, [9; 3])),
        });
        assert_eq!(sums.colors(), None);
    }
}
