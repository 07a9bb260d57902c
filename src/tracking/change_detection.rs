//! Change detection: reuses the last report while the depth image differs from a reference only by sensor noise.

use super::block_readings::BlockReadings;
use super::report::{StepReport, TrackingStagesMs};
use crate::settings::ChangeSettings;
use serde::{Deserialize, Serialize};
use tryon_geometry::camera::DepthImage;
use tryon_geometry::spatial::OrganisedCloud;

/// Blocks of a depth image and the report of that frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct DepthReference {
    blocks: BlockReadings,
    /// Frames that reused the report.
    #[serde(rename = "kept")]
    reused: u32,
    report: StepReport,
}

impl DepthReference {
    /// Reference of the whole image, at every `step`-th pixel.
    pub(super) fn of_image(image: &DepthImage, step: u32, report: &StepReport) -> Self {
        Self::new(BlockReadings::of_image(image, step), report)
    }

    /// Reference of the blocks that hold any of a grid's `cells`, and of their neighbours.
    pub(super) fn of_cells(
        image: &DepthImage,
        grid: &OrganisedCloud,
        cells: &[u32],
        report: &StepReport,
    ) -> Self {
        Self::new(BlockReadings::about_cells(image, grid, cells), report)
    }

    fn new(blocks: BlockReadings, report: &StepReport) -> Self {
        // Times are of that frame alone, and no part of a state.
        let report = StepReport {
            stages_ms: TrackingStagesMs::default(),
            ..report.clone()
        };
        Self {
            blocks,
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
        if self.reused >= settings.most_reused || self.blocks.has_changed(image, settings) {
            return None;
        }
        self.reused += 1;
        Some(&self.report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block_readings::BLOCK;
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
        reference
            .blocks
            .has_changed(image, &ChangeSettings::default())
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
        assert_eq!(
            of_person.blocks.blocks.len(),
            9,
            "a block and its neighbours"
        );
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
