//! Readings of a depth image in blocks, compared with later images: what differs by more than a sensor's noise has changed.

use crate::settings::ChangeSettings;
use serde::{Deserialize, Serialize};
use tryon_geometry::camera::DepthImage;
use tryon_geometry::spatial::OrganisedCloud;

/// Samples along a side of a block.
pub(super) const BLOCK: usize = 8;
/// Samples of a block.
const AREA: usize = BLOCK * BLOCK;

/// Blocks of a depth image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct BlockReadings {
    /// Pixels between samples.
    step: u32,
    /// Columns of blocks in the image.
    columns: u32,
    /// Row-major blocks that are compared.
    pub(super) blocks: Vec<u32>,
    /// Readings, millimetres, [`AREA`] of each block in turn.
    readings: Vec<u16>,
}

impl BlockReadings {
    /// The whole image, at every `step`-th pixel.
    pub(super) fn of_image(image: &DepthImage, step: u32) -> Self {
        let [columns, rows] = size(image, step);
        Self::new(image, step, columns, (0..columns * rows).collect())
    }

    /// The blocks that hold any of a grid's `cells`, and their neighbours.
    pub(super) fn about_cells(image: &DepthImage, grid: &OrganisedCloud, cells: &[u32]) -> Self {
        let [columns, rows] = size(image, grid.stride());
        let counts = cell_counts(grid, cells, [columns, rows]);
        let holds = |c: u32, r: u32| counts[(r * columns + c) as usize] > 0;
        let is_near = |b: &u32| {
            let (c, r) = (b % columns, b / columns);
            let near = |k: u32, most: u32| k.saturating_sub(1)..(k + 2).min(most);
            near(r, rows).any(|r| near(c, columns).any(|c| holds(c, r)))
        };
        let blocks = (0..columns * rows).filter(is_near).collect();
        Self::new(image, grid.stride(), columns, blocks)
    }

    /// The blocks that a grid's `cells` fill.
    pub(super) fn within_cells(image: &DepthImage, grid: &OrganisedCloud, cells: &[u32]) -> Self {
        let [columns, rows] = size(image, grid.stride());
        let counts = cell_counts(grid, cells, [columns, rows]);
        let is_full = |b: &u32| counts[*b as usize] as usize == AREA;
        let blocks = (0..columns * rows).filter(is_full).collect();
        Self::new(image, grid.stride(), columns, blocks)
    }

    fn new(image: &DepthImage, step: u32, columns: u32, blocks: Vec<u32>) -> Self {
        let mut readings = Vec::with_capacity(blocks.len() * AREA);
        for &block in &blocks {
            samples(image, step, columns, block, |d| readings.push(d));
        }
        Self {
            step,
            columns,
            blocks,
            readings,
        }
    }

    /// True for an image of another size, and for one that differs by more than noise.
    pub(super) fn has_changed(&self, image: &DepthImage, settings: &ChangeSettings) -> bool {
        if self.columns != size(image, self.step)[0] {
            return true;
        }
        let (mut sum, mut counted) = (0.0, 0);
        for (&block, before) in self.blocks.iter().zip(self.readings.chunks_exact(AREA)) {
            let (mut first, mut second, mut any, mut k) = (0i32, 0i32, false, 0);
            samples(image, self.step, self.columns, block, |now| {
                let was = before[k];
                k += 1;
                any |= (now | was) != 0;
                let change = match (was, now) {
                    (0, 0) => 0,
                    (_, 0) => settings.most_change,
                    (0, _) => -settings.most_change,
                    _ => (i32::from(now) - i32::from(was))
                        .clamp(-settings.most_change, settings.most_change),
                };
                first += change;
                second += change * change;
            });
            if !any {
                continue;
            }
            let mean = first as f32 / AREA as f32;
            let variance = (second as f32 / AREA as f32 - mean * mean).max(0.0);
            let share =
                mean * mean / (variance / AREA as f32 + settings.dead_band * settings.dead_band);
            if share > settings.changed[1] * settings.changed[1] {
                return true;
            }
            sum += share;
            counted += 1;
        }
        sum > settings.changed[0] * settings.changed[0] * counted as f32
    }

    /// Root mean square over the blocks of the standard error of a block's mean change, millimetres: what noise hides. 0
    /// without blocks.
    pub(super) fn standard_error(&self, image: &DepthImage, settings: &ChangeSettings) -> f32 {
        let most = settings.most_change;
        let blocks = self.blocks.iter().zip(self.readings.chunks_exact(AREA));
        let of_block = |(&block, before): (&u32, &[u16])| {
            let (mut first, mut second, mut k) = (0i32, 0i32, 0);
            samples(image, self.step, self.columns, block, |now| {
                let change = (i32::from(now) - i32::from(before[k])).clamp(-most, most);
                k += 1;
                first += change;
                second += change * change;
            });
            let mean = first as f32 / AREA as f32;
            (second as f32 / AREA as f32 - mean * mean).max(0.0) / AREA as f32
        };
        let sum: f32 = blocks.map(of_block).sum();
        (sum / self.blocks.len().max(1) as f32).sqrt()
    }

    /// True for an image with the same readings to the bit: a picture shown again, not seen again.
    pub(super) fn is_repeated(&self, image: &DepthImage) -> bool {
        let blocks = self.blocks.iter().zip(self.readings.chunks_exact(AREA));
        blocks.into_iter().all(|(&block, before)| {
            let (mut same, mut k) = (true, 0);
            samples(image, self.step, self.columns, block, |now| {
                same &= before[k] == now;
                k += 1;
            });
            same
        })
    }
}

/// Cells in each block.
fn cell_counts(grid: &OrganisedCloud, cells: &[u32], [columns, rows]: [u32; 2]) -> Vec<u32> {
    let grid_columns = grid.size().0 as u32;
    let mut counts = vec![0; (columns * rows) as usize];
    for &cell in cells {
        let (c, r) = (
            cell % grid_columns / BLOCK as u32,
            cell / grid_columns / BLOCK as u32,
        );
        if c < columns && r < rows {
            counts[(r * columns + c) as usize] += 1;
        }
    }
    counts
}

/// Columns and rows of whole blocks.
fn size(image: &DepthImage, step: u32) -> [u32; 2] {
    let side = (step.max(1) * BLOCK as u32).max(1);
    [image.width() / side, image.height() / side]
}

/// Visits the readings of one block, millimetres, at the middle of their cells.
fn samples(image: &DepthImage, step: u32, columns: u32, block: u32, mut f: impl FnMut(u16)) {
    let (step, width) = (step.max(1) as usize, image.width() as usize);
    let (row, column) = (
        (block / columns) as usize * BLOCK,
        (block % columns) as usize * BLOCK,
    );
    for row in row..row + BLOCK {
        let start = (row * step + step / 2) * width + column * step + step / 2;
        let line = image.data().get(start..).unwrap_or_default();
        line.iter().step_by(step).take(BLOCK).for_each(|d| f(*d));
    }
}
