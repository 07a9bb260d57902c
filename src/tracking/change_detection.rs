//! Change detection: reuses the last report while the depth image differs from a reference only by sensor noise.

use super::report::{StepReport, TrackingStagesMs};
use crate::settings::ChangeSettings;
use serde::{Deserialize, Serialize};
use tryon_geometry::camera::DepthImage;
use tryon_geometry::spatial::OrganisedCloud;

/// Samples along a side of a block.
const BLOCK: usize = 8;
/// Samples of a block.
const AREA: usize = BLOCK * BLOCK;

/// Blocks of a depth image and the report of that frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct DepthReference {
    /// Pixels between samples.
    step: u32,
    /// Columns of blocks in the image.
    columns: u32,
    /// Row-major blocks that are compared.
    blocks: Vec<u32>,
    /// Readings, millimetres, [`AREA`] of each block in turn.
    readings: Vec<u16>,
    /// Frames that reused the report.
    #[serde(rename = "kept")]
    reused: u32,
    report: StepReport,
}

impl DepthReference {
    /// Reference of the whole image, at every `step`-th pixel.
    pub(super) fn of_image(image: &DepthImage, step: u32, report: &StepReport) -> Self {
        let [columns, rows] = size(image, step);
        Self::new(image, step, columns, (0..columns * rows).collect(), report)
    }

    /// Reference of the blocks that hold any of a grid's `cells`, and of their neighbours.
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
            stages_ms: TrackingStagesMs::default(),
            ..report.clone()
        };
        Self {
            step,
            columns,
            blocks,
            readings,
            reused: 0,
            report,
        }
    }

    /// Report of the reference frame when `image` equals it but for noise; counts the reuse.
    pub(super) fn reuse(
        &mut self,
        image: &DepthImage,
        settings: &ChangeSettings,
    ) -> Option<&StepReport> {
        if self.reused >= settings.most_reused
            || self.columns != size(image, self.step)[0]
            || self.has_changed(image, settings)
        {
            return None;
        }
        self.reused += 1;
        Some(&self.report)
    }

    fn has_changed(&self, image: &DepthImage, settings: &ChangeSettings) -> bool {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Skipped;
    use crate::status::Status;
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
            agreement: Default::default(),
            confidence: Vec::new(),
            pose_age: 0,
            skipped: Skipped::default(),
            stages_ms: TrackingStagesMs::default(),
        }
    }

    /// A slanted wall at 3 m and a body of 60 columns from `left` on at 2 m + `nearer` mm; noise of `sigma` mm and a share of
    /// lost pixels.
    fn image_of(frame: u64, sigma: f32, lost: f64, nearer: f32, left: u32) -> DepthImage {
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

    fn has_changed(reference: &DepthReference, image: &DepthImage) -> bool {
        reference.has_changed(image, &ChangeSettings::default())
    }

    #[test]
    fn noise_is_no_change_and_motion_is_one() {
        for (sigma, lost) in [(0.0, 0.0), (3.0, 0.0), (10.0, 0.02)] {
            let seen = |frame, nearer, left| {
                let first = image_of(0, sigma, lost, 0.0, 40);
                let reference = DepthReference::of_image(&first, 2, &report());
                has_changed(&reference, &image_of(frame, sigma, lost, nearer, left))
            };
            let noisy = (1..40).filter(|f| seen(*f, 0.0, 40)).count();
            assert!(
                noisy <= 1,
                "{noisy} of 39 images of a body at rest count as changed at {sigma} mm"
            );
            let standard_error = 2.0 * sigma / BLOCK as f32;
            let far = ChangeSettings::default().dead_band + standard_error;
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
        let first = image_of(0, 3.0, 0.0, 0.0, 40);
        let reference = DepthReference::of_image(&first, 2, &report());
        let mut moved = image_of(7, 3.0, 0.0, 0.0, 40);
        for v in 60..76 {
            for u in 60..76 {
                moved.data_mut()[(v * WIDTH + u) as usize] -= 15;
            }
        }
        assert!(has_changed(&reference, &moved));
    }

    #[test]
    fn reuse_is_bounded_and_only_blocks_of_the_cells_are_compared() {
        let first = image_of(0, 3.0, 0.0, 0.0, 40);
        let mut reference = DepthReference::of_image(&first, 2, &report());
        let kept = (1..=ChangeSettings::default().most_reused + 3)
            .filter(|_| {
                reference
                    .reuse(&first, &ChangeSettings::default())
                    .is_some()
            })
            .count();
        assert_eq!(kept as u32, ChangeSettings::default().most_reused);
        let camera = tryon_geometry::camera::Intrinsics {
            width: WIDTH,
            height: HEIGHT,
            ..tryon_geometry::camera::Intrinsics::KINECT_V1
        };
        let grid = OrganisedCloud::new(&camera, Some(2));
        let cell = 30 * (WIDTH / 2) + 36;
        let of_person = DepthReference::of_cells(&first, &grid, &[cell], &report());
        assert_eq!(of_person.blocks.len(), 9, "a block and its neighbours");
        let mut elsewhere = first.clone();
        elsewhere.data_mut()[..2000].fill(0);
        assert!(
            has_changed(&DepthReference::of_image(&first, 2, &report()), &elsewhere)
                && !has_changed(&of_person, &elsewhere)
        );
        // Another image size, one without a reading, and one smaller than a block.
        assert!(
            reference
                .clone()
                .reuse(&DepthImage::empty(80, 60), &ChangeSettings::default())
                .is_none()
        );
        let dark = DepthImage::empty(WIDTH, HEIGHT);
        assert!(!has_changed(
            &DepthReference::of_image(&dark, 2, &report()),
            &dark
        ));
        assert!(has_changed(
            &DepthReference::of_image(&dark, 2, &report()),
            &first
        ));
        let tiny = DepthImage::empty(5, 5);
        assert!(!has_changed(
            &DepthReference::of_image(&tiny, 2, &report()),
            &tiny
        ));
    }
}
