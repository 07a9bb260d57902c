//! Sheets of cropped pictures that a person looks at beside each row.

use super::border::Seen;
use crate::{EvaluateError, Sheet};
use std::path::Path;
use tryon_geometry::camera::ColorImage;

/// Columns of a sheet.
const COLUMNS: usize = 4;
/// Most pictures of a sheet.
const MOST: usize = 24;
/// Colours of pixels judged wrong: garment drawn over the person, and left away.
pub(super) const FALSE: [u8; 3] = [255, 0, 60];
pub(super) const MISSED: [u8; 3] = [0, 255, 0];

/// Crops of pictures of one size.
#[derive(Default)]
pub(super) struct Gallery {
    cell: [u32; 2],
    cells: Vec<Vec<u8>>,
}

/// Columns and rows of a crop, from the first to before the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Crop {
    pub(super) corner: [u32; 2],
    pub(super) size: [u32; 2],
}

impl Crop {
    /// Crop around marked pixels, with a margin; as large as the picture without any.
    pub(super) fn around(marks: impl Iterator<Item = usize>, size: [u32; 2]) -> Self {
        const MARGIN: u32 = 24;
        let mut bounds = [[u32::MAX, 0]; 2];
        for i in marks {
            let at = [i as u32 % size[0], i as u32 / size[0]];
            for (b, x) in bounds.iter_mut().zip(at) {
                *b = [b[0].min(x), b[1].max(x)];
            }
        }
        let side = |k: usize| {
            if bounds[k][0] > bounds[k][1] {
                return [0, size[k]];
            }
            let from = bounds[k][0].saturating_sub(MARGIN);
            [from, (bounds[k][1] + MARGIN).min(size[k]) - from]
        };
        let (x, y) = (side(0), side(1));
        Self {
            corner: [x[0], y[0]],
            size: [x[1], y[1]],
        }
    }
}

impl Gallery {
    /// Adds a crop; all have the size of the first. Nothing once the sheet is full.
    pub(super) fn add(&mut self, picture: &ColorImage, crop: &Crop) {
        if self.cells.len() >= MOST {
            return;
        }
        if self.cells.is_empty() {
            self.cell = crop.size;
        }
        let [width, height] = self.cell;
        let fits = |from: u32, side: u32, most: u32| from.min(most.saturating_sub(side));
        let left = fits(crop.corner[0], width, picture.width());
        let top = fits(crop.corner[1], height, picture.height());
        let mut cell = Vec::with_capacity(3 * (width * height) as usize);
        for v in top..top + height {
            for u in left..left + width {
                cell.extend(picture.at(u, v));
            }
        }
        self.cells.push(cell);
    }

    /// Writes the sheet; nothing without pictures.
    pub(super) fn write(self, path: &Path) -> Result<(), EvaluateError> {
        let mut sheet = Sheet::new(self.cell, COLUMNS);
        self.cells.into_iter().for_each(|cell| sheet.push(cell));
        sheet.write(path)
    }
}

/// The picture with wrong decisions in colour: `is_drawn` against `truth` where `is_judged`.
pub(super) fn marked(
    picture: &ColorImage,
    truth: &[Seen],
    is_judged: &[bool],
    is_drawn: &[bool],
) -> ColorImage {
    let mut out = picture.clone();
    for (i, pixel) in out.data_mut().chunks_exact_mut(3).enumerate() {
        if !is_judged[i] {
            continue;
        }
        match (truth[i], is_drawn[i]) {
            (Seen::Person, true) => pixel.copy_from_slice(&FALSE),
            (Seen::Garment, false) => pixel.copy_from_slice(&MISSED),
            _ => (),
        }
    }
    out
}
