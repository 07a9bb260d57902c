//! Pictures that show nothing new: what came of the last one that was gone through holds for them too.

use super::{StagesMs, StepReport};
use crate::camera::DepthImage;
use crate::spatial::OrganisedCloud;
use serde::{Deserialize, Serialize};

/// Samples along a side of a block.
const BLOCK: usize = 8;
/// Samples of a block.
const AREA: usize = BLOCK * BLOCK;
/// A sample counts as at most this much nearer or farther than before, millimetres; one that came or went counts in full.
const MOST: i32 = 30;
/// Changes of a block's mean depth below this are no change, millimetres: a quarter of the sensor's
/// noise at 2 m.
const DEAD: f32 = 0.75;
/// Blocks change by their own noise: root mean square over all blocks, and the largest, as multiples of what the spread of
/// a block's samples lets its mean change by. A surface that moves by 1.5 [`DEAD`] trips the first, a hand the second.
const CHANGED: [f32; 2] = [1.25, 5.0];
/// After so many pictures in a row one is gone through whatever it shows, so that motion that hides in the noise is at most
/// a fifth of a second late. At 0 / 5: a still person's step takes 1.29 / 0.42 ms, joints are 5.5 / 5.5 mm off.
const MOST_KEPT: u32 = 5;

/// Parts of a depth image as they were, and the report of that frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Reference {
    /// Pixels between samples.
    step: u32,
    /// Columns of blocks that the image has.
    columns: u32,
    /// Row-major blocks that count.
    blocks: Vec<u32>,
    /// Millimetres, [`AREA`] of each block in turn.
    readings: Vec<u16>,
    /// Frames since.
    kept: u32,
    report: StepReport,
}

impl Reference {
    /// Blocks of all the image, at every `step`-th pixel.
    pub(super) fn of_all(image: &DepthImage, step: u32, report: &StepReport) -> Self {
        let [columns, rows] = size(image, step);
        Self::new(image, step, columns, (0..columns * rows).collect(), report)
    }

    /// The blocks that hold any of a grid's `cells`, and those beside them.
    pub(super) fn of_cells(
        image: &DepthImage,
        grid: &OrganisedCloud,
        cells: &[u32],
        report: &StepReport,
    ) -> Self {
        let (step, grid_columns) = (grid.stride(), grid.size().0 as u32);
        let [columns, rows] = size(image, step);
        let mut counts = vec![false; (columns * rows) as usize];
        for &cell in cells {
            let (c, r) = (
                cell % grid_columns / BLOCK as u32,
                cell / grid_columns / BLOCK as u32,
            );
            for r in r.saturating_sub(1)..(r + 2).min(rows) {
                for c in c.saturating_sub(1)..(c + 2).min(columns) {
                    counts[(r * columns + c) as usize] = true;
                }
            }
        }
        let blocks = (0..columns * rows)
            .filter(|b| counts[*b as usize])
            .collect();
        Self::new(image, step, columns, blocks, report)
    }

    fn new(
        image: &DepthImage,
        step: u32,
        columns: u32,
        blocks: Vec<u32>,
        report: &StepReport,
    ) -> Self {
        let mut readings = Vec::with_capacity(blocks.len() * AREA);
        for &block in &blocks {
            samples(image, step, columns, block, |d| readings.push(d));
        }
        // Times are of that frame alone, and no part of a state.
        let report = StepReport {
            stages_ms: StagesMs::default(),
            ..report.clone()
        };
        Self {
            step,
            columns,
            blocks,
            readings,
            kept: 0,
            report,
        }
    }

    /// The report of the frame this was made of, when `image` shows the same but for noise. Counts what it keeps.
    pub(super) fn keep(&mut self, image: &DepthImage) -> Option<&StepReport> {
        if self.kept >= MOST_KEPT
            || self.columns != size(image, self.step)[0]
            || self.changed(image)
        {
            return None;
        }
        self.kept += 1;
        Some(&self.report)
    }

    fn changed(&self, image: &DepthImage) -> bool {
        let (mut sum, mut counted) = (0.0, 0);
        for (&block, before) in self.blocks.iter().zip(self.readings.chunks_exact(AREA)) {
            let (mut first, mut second, mut any, mut k) = (0i32, 0i32, false, 0);
            samples(image, self.step, self.columns, block, |now| {
                let was = before[k];
                k += 1;
                any |= (now | was) != 0;
                let way = match (was, now) {
                    (0, 0) => 0,
                    (_, 0) => MOST,
                    (0, _) => -MOST,
                    _ => (i32::from(now) - i32::from(was)).clamp(-MOST, MOST),
                };
                first += way;
                second += way * way;
            });
            if !any {
                continue;
            }
            let mean = first as f32 / AREA as f32;
            let variance = (second as f32 / AREA as f32 - mean * mean).max(0.0);
            let share = mean * mean / (variance / AREA as f32 + DEAD * DEAD);
            if share > CHANGED[1] * CHANGED[1] {
                return true;
            }
            sum += share;
            counted += 1;
        }
        sum > CHANGED[0] * CHANGED[0] * counted as f32
    }
}

/// Columns and rows of whole blocks.
fn size(image: &DepthImage, step: u32) -> [u32; 2] {
    let side = (step.max(1) * BLOCK as u32).max(1);
    [image.width() / side, image.height() / side]
}

/// The readings of one block, millimetres, in the middle of their cells.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::{Skipped, Status};
    use rand::{Rng, SeedableRng};

    const WIDTH: u32 = 160;
    const HEIGHT: u32 = 120;

    fn report() -> StepReport {
        StepReport {
            status: Status::Tracking,
            iterations: 3,
            converged: true,
            visible_points: 500,
            person_cells: 4000,
            residual_mm: 2.0,
            explained: 0.9,
            matched: 0.9,
            quality: 0.8,
            confidence: Vec::new(),
            pose_age: 0,
            skipped: Skipped::default(),
            stages_ms: StagesMs::default(),
        }
    }

    /// A slanted wall at about 2 m, in front of it a body of `body` pixels from column 40 on; noise of `sigma` millimetres and
    /// a share of lost pixels.
    fn picture(frame: u64, sigma: f32, lost: f64, nearer: f32, left: u32) -> DepthImage {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(frame);
        let mut data = Vec::new();
        for v in 0..HEIGHT {
            for u in 0..WIDTH {
                let body = (left..left + 60).contains(&u) && v > 10;
                let z = if body {
                    2000.0 + nearer
                } else {
                    3000.0 + u as f32
                };
                let noise: f32 =
                    (0..4).map(|_| rng.random_range(-1.0f32..1.0)).sum::<f32>() * (0.75f32).sqrt();
                data.push(if rng.random_bool(lost) {
                    0
                } else {
                    (z + v as f32 + sigma * noise).round() as u16
                });
            }
        }
        DepthImage::new(WIDTH, HEIGHT, data).expect("size")
    }

    #[test]
    fn noise_is_no_change_and_motion_is() {
        for (sigma, lost) in [(0.0, 0.0), (3.0, 0.0), (10.0, 0.02)] {
            let seen = |frame, nearer, left| {
                let first = picture(0, sigma, lost, 0.0, 40);
                let reference = Reference::of_all(&first, 2, &report());
                reference.changed(&picture(frame, sigma, lost, nearer, left))
            };
            let noisy = (1..40).filter(|f| seen(*f, 0.0, 40)).count();
            assert!(
                noisy <= 1,
                "{noisy} of 39 pictures of a still body count as changed at {sigma} mm"
            );
            // As far as the spread of a block's mean lets a camera see it.
            let far = DEAD + 2.0 * sigma / BLOCK as f32;
            assert!(
                seen(50, 3.0 * far, 40),
                "{} mm nearer at {sigma} mm",
                3.0 * far
            );
            let sides = (seen(51, 0.0, 44), seen(52, 0.0, 36));
            assert_eq!(sides, (true, true), "two cells to the side at {sigma} mm");
        }
    }

    #[test]
    fn a_hand_alone_is_a_change() {
        let first = picture(0, 3.0, 0.0, 0.0, 40);
        let reference = Reference::of_all(&first, 2, &report());
        let mut moved = picture(7, 3.0, 0.0, 0.0, 40);
        for v in 60..76 {
            for u in 60..76 {
                moved.data_mut()[(v * WIDTH + u) as usize] -= 15;
            }
        }
        assert!(reference.changed(&moved));
    }

    #[test]
    fn a_picture_is_gone_through_now_and_then_and_only_what_counts_is_compared() {
        let first = picture(0, 3.0, 0.0, 0.0, 40);
        let mut reference = Reference::of_all(&first, 2, &report());
        let kept = (1..=MOST_KEPT + 3)
            .filter(|_| reference.keep(&first).is_some())
            .count();
        assert_eq!(kept as u32, MOST_KEPT);
        let camera = crate::camera::Intrinsics {
            width: WIDTH,
            height: HEIGHT,
            ..crate::camera::Intrinsics::KINECT_V1
        };
        let grid = OrganisedCloud::new(&camera, Some(2));
        let cell = 30 * (WIDTH / 2) + 36;
        let of_person = Reference::of_cells(&first, &grid, &[cell], &report());
        assert_eq!(of_person.blocks.len(), 9, "a block and those beside it");
        let mut elsewhere = first.clone();
        elsewhere.data_mut()[..2000].fill(0);
        assert!(
            Reference::of_all(&first, 2, &report()).changed(&elsewhere)
                && !of_person.changed(&elsewhere)
        );
        // Another size of picture, one without a reading, and one smaller than a block.
        assert!(reference.clone().keep(&DepthImage::empty(80, 60)).is_none());
        let dark = DepthImage::empty(WIDTH, HEIGHT);
        assert!(!Reference::of_all(&dark, 2, &report()).changed(&dark));
        assert!(Reference::of_all(&dark, 2, &report()).changed(&first));
        let tiny = DepthImage::empty(5, 5);
        assert!(!Reference::of_all(&tiny, 2, &report()).changed(&tiny));
    }
}
