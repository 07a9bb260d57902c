//! Small pictures of depth in a terminal: half blocks in colours, or characters.

use crate::depth_picture::{DepthColorSettings, depth_color};
use std::fmt::Write;
use tryon::geometry::camera::DepthImage;
use tryon::geometry::math::order_statistics::median;

/// Characters from near to far.
const NEAR_TO_FAR: [char; 7] = ['@', '%', '#', '+', '-', ':', '.'];

/// Look of pictures in a terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Style {
    /// Two pixels a character, in colours of 24 bits.
    HalfBlocks,
    /// One pixel a character, near ones dense; a space without reading.
    Characters,
}

/// A picture of `columns` characters, a line a row, each ended. Characters are twice as high as they are wide.
pub(crate) fn picture(depth: &DepthImage, columns: usize, style: Style) -> String {
    let range = DepthColorSettings::default().range;
    let share = f64::from(depth.height()) / f64::from(depth.width().max(1));
    let lines = ((columns as f64 * share / 2.0).round() as usize).max(1);
    let mut out = String::new();
    match style {
        Style::HalfBlocks => {
            let cells = small(depth, [columns, 2 * lines]);
            for pair in cells.chunks_exact(2 * columns) {
                let (upper, lower) = pair.split_at(columns);
                for (upper, lower) in upper.iter().zip(lower) {
                    let ([r, g, b], [x, y, z]) =
                        (depth_color(*upper, range), depth_color(*lower, range));
                    let _ = write!(out, "\x1b[38;2;{r};{g};{b};48;2;{x};{y};{z}m▀");
                }
                out.push_str("\x1b[0m\n");
            }
        }
        Style::Characters => {
            for row in small(depth, [columns, lines]).chunks_exact(columns) {
                out.extend(row.iter().map(|reading| character(*reading, range)));
                out.push('\n');
            }
        }
    }
    out
}

fn character(reading: u16, [near, far]: [f32; 2]) -> char {
    if reading == 0 {
        return ' ';
    }
    let share = ((f32::from(reading) * 1e-3 - near) / (far - near)).clamp(0.0, 1.0);
    let at = (share * NEAR_TO_FAR.len() as f32) as usize;
    NEAR_TO_FAR[at.min(NEAR_TO_FAR.len() - 1)]
}

/// The image at another size: the median reading of each cell (mm), 0 where most of the cell has none.
fn small(depth: &DepthImage, [columns, rows]: [usize; 2]) -> Vec<u16> {
    let (width, height) = (depth.width() as usize, depth.height() as usize);
    let mut cells = Vec::with_capacity(columns * rows);
    let span = |i: usize, of: usize, side: usize| {
        let from = i * side / of;
        from..((i + 1) * side / of).max(from + 1).min(side)
    };
    for row in 0..rows {
        for column in 0..columns {
            let pixels = span(row, rows, height).flat_map(|v| {
                let part = span(column, columns, width);
                depth.data()[v * width + part.start..v * width + part.end].iter()
            });
            let all: Vec<u16> = pixels.copied().collect();
            let mut read: Vec<f32> = (all.iter().filter(|d| **d > 0))
                .map(|d| f32::from(*d))
                .collect();
            let is_hole = 2 * read.len() < all.len().max(1);
            let reading = if is_hole { None } else { median(&mut read) };
            cells.push(reading.unwrap_or(0.0) as u16);
        }
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A near board on the left, a far wall on the right, nothing below.
    fn scene() -> DepthImage {
        let pixels = (0..80 * 40).map(|i| match (i % 80, i / 80) {
            (_, 20..) => 0,
            (0..40, _) => 600,
            _ => 4400,
        });
        DepthImage::new(80, 40, pixels.collect()).expect("its size")
    }

    #[test]
    fn characters_are_dense_where_things_are_near() {
        let got = picture(&scene(), 16, Style::Characters);
        let want = "@@@@@@@@........\n".repeat(2) + &format!("{}\n", " ".repeat(16)).repeat(2);
        assert_eq!(got, want);
    }

    #[test]
    fn half_blocks_have_two_pixels_a_character() {
        let got = picture(&scene(), 16, Style::HalfBlocks);
        assert_eq!(got.lines().count(), 4);
        assert_eq!(got.matches('▀').count(), 64);
        assert!(got.lines().all(|l| l.ends_with("\x1b[0m")));
        let black = "\x1b[38;2;0;0;0;48;2;0;0;0m▀";
        assert_eq!(got.matches(black).count(), 32);
    }

    #[test]
    fn small_and_empty_images_have_pictures() {
        let one = DepthImage::new(1, 1, vec![1000]).expect("one");
        assert!(!picture(&one, 8, Style::Characters).trim().is_empty());
        let none = picture(&DepthImage::default(), 8, Style::Characters);
        assert!(none.trim().is_empty());
    }
}
