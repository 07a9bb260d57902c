//! Agreement of a posed body with its frame, by area: body surface in measured free space, readings left uncovered.
//!
//! A residual compares what was paired and stays small when the rest is wrong. Here every cell counts that shows the body
//! or the subject, so that a limb in the air and a limb without a body are seen.

use crate::fit::{FitContext, FitScratch};
use crate::model::TrackerModel;
use crate::registration::{IndexImage, Observation};
use crate::settings::AssessSettings;
use serde::{Deserialize, Serialize};
use tryon_body::Pose;
use tryon_geometry::spatial::{Label, OrganisedCloud, chessboard_distances};

/// Number of [`BodyPart`](tryon_body::parts::BodyPart)s.
pub(crate) const PARTS: usize = 5;

/// Areas of disagreement as shares of the area in the image that subject and body cover together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Body surface in measured free space, beside the subject or in front of it; that of parts without return left out.
    pub in_free_space: f32,
    /// Readings of the subject without body: beside it or in front of it.
    pub uncovered: f32,
    /// Share of the visible surface of each [`BodyPart`](tryon_body::parts::BodyPart) in free space, 0 to 1; 0 for a part out of view.
    pub parts: [f32; PARTS],
    /// Share of the visible surface of each part that gives no return, 0 to 1.
    #[serde(default)]
    pub(crate) unknown: [f32; PARTS],
}

impl Agreement {
    /// Share of the common area that is wrong, 0 to 1.
    pub fn wrong(&self) -> f32 {
        self.in_free_space + self.uncovered
    }
}

/// Cells of one part of the drawn body.
#[derive(Clone, Copy, Debug, Default)]
struct PartArea {
    all: u32,
    /// In measured free space.
    free: u32,
    /// Without any reading.
    unknown: u32,
}

impl PartArea {
    /// False for a part that mostly gives no return (black trousers): where it is isn't known, and its joints say so.
    fn has_return(&self) -> bool {
        2 * self.unknown <= self.all
    }
}

/// Scratch of the comparison.
#[derive(Clone, Debug, Default)]
pub(crate) struct AgreementScratch {
    /// Distance of each cell to the subject and to the drawn body, cells.
    to_subject: Vec<u16>,
    to_body: Vec<u16>,
}

impl AgreementScratch {
    /// Compares `pose` with the readings.
    pub(crate) fn measure(
        &mut self,
        context: &FitContext<'_>,
        pose: &Pose,
        scratch: &mut FitScratch,
    ) -> Agreement {
        scratch.draw(context, pose);
        let (model, observation) = (context.model, context.observation);
        self.measure_image(model, observation, &scratch.pairing.image)
    }

    fn measure_image(
        &mut self,
        model: &TrackerModel,
        observation: &Observation<'_>,
        image: &IndexImage,
    ) -> Agreement {
        let settings = &model.config.assess;
        let grid = observation.grid;
        let is_subject = |k: usize| grid.labels[k] == Label::Person && grid.depth[k] > 0.0;
        let is_body = |k: usize| image.index[k] != IndexImage::NONE;
        let nothing = |_| u16::MAX;
        chessboard_distances(grid, is_subject, nothing, &mut self.to_subject);
        chessboard_distances(grid, is_body, nothing, &mut self.to_body);
        let seam = seam(observation, settings);
        let apart = settings.apart;

        let (mut area, mut uncovered) = (0u32, 0u32);
        let mut parts = [PartArea::default(); PARTS];
        for k in 0..grid.depth.len() {
            let (body, subject) = (is_body(k), is_subject(k));
            area += u32::from(body || subject);
            let near = subject && body && image.depth[k] > grid.depth[k] + apart;
            uncovered += u32::from(near || subject && self.to_body[k] > seam);
            if body {
                let bone = usize::from(model.bones[image.index[k] as usize]);
                let part = &mut parts[model.parts[bone]];
                part.free += u32::from(self.is_free(grid, k, image.depth[k], seam, apart));
                part.unknown += u32::from(grid.labels[k] == Label::Unknown);
                part.all += 1;
            }
        }
        let judged = parts.iter().filter(|p| p.has_return());
        let free: u32 = judged.map(|p| p.free).sum();
        let area = area.max(1) as f32;
        Agreement {
            in_free_space: free as f32 / area,
            uncovered: uncovered as f32 / area,
            parts: parts.map(|p| p.free as f32 / p.all.max(1) as f32),
            unknown: parts.map(|p| p.unknown as f32 / p.all.max(1) as f32),
        }
    }

    /// True when a body surface at depth `z` stands in cell `k` before a farther reading, or where the background was
    /// removed.
    fn is_free(&self, grid: &OrganisedCloud, k: usize, z: f32, seam: u16, apart: f32) -> bool {
        match grid.labels[k] {
            Label::Unknown => false,
            Label::Person => z < grid.depth[k] - apart,
            Label::Background if grid.depth[k] == 0.0 => self.to_subject[k] > seam,
            Label::Background | Label::Floor | Label::Other => {
                z < grid.depth[k] - apart && self.to_subject[k] > seam
            }
        }
    }
}

/// Width of the seam at the subject's distance, cells.
fn seam(observation: &Observation<'_>, settings: &AssessSettings) -> u16 {
    let grid = observation.grid;
    let depths = observation.cells.iter().map(|&c| grid.depth[c as usize]);
    let (sum, n) = depths
        .filter(|d| *d > 0.0)
        .fold((0.0, 0.0), |(s, n), d| (s + d, n + 1.0f32));
    let focal = grid.focal()[0].max(grid.focal()[1]);
    let cells = settings.seam * focal * n / f32::max(sum, f32::MIN_POSITIVE);
    (cells.round().min(f32::from(u16::MAX)) as u16).max(settings.least_seam)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::{DepthScan, TestScene};
    use tryon_body::parts::BodyPart;

    /// Agreement of a body in one pose with readings of it in another.
    fn agreement(scene: &TestScene, body_pose: &Pose, seen: &Pose) -> Agreement {
        let scan = DepthScan::new(&scene.model, &scene.depth(seen)).background_removed();
        let (body, observation) = (scene.body(), scan.observation());
        let context = scene.context(&body, &observation);
        let mut scratch = AgreementScratch::default();
        scratch.measure(&context, body_pose, &mut FitScratch::default())
    }

    /// The rest pose with the left arm raised sideways.
    fn raised(scene: &TestScene) -> Pose {
        let mut pose = scene.pose.clone();
        let skeleton = scene.model.template.skeleton();
        pose.set(skeleton, "left_shoulder", &[0.0, 0.0, 1.2]);
        pose
    }

    #[test]
    fn the_true_pose_agrees_with_its_readings() {
        let scene = TestScene::new(1000, 480);
        let agreement = agreement(&scene, &scene.pose, &scene.pose);
        assert!(agreement.wrong() < 0.05, "{agreement:?}");
    }

    #[test]
    fn an_arm_in_the_air_is_in_free_space_and_a_missed_arm_uncovered() {
        let scene = TestScene::new(1000, 480);
        let raised = raised(&scene);
        for (body, seen) in [(&raised, &scene.pose), (&scene.pose, &raised)] {
            let agreement = agreement(&scene, body, seen);
            let left = agreement.parts[BodyPart::LeftArm as usize];
            let right = agreement.parts[BodyPart::RightArm as usize];
            assert!(agreement.uncovered > 0.03, "{agreement:?}");
            assert!(agreement.in_free_space > 0.03, "{agreement:?}");
            assert!(left > 0.4 && right < 0.2, "{agreement:?}");
        }
    }

    #[test]
    fn no_readings_and_no_body_in_view_agree_in_nothing() {
        let scene = TestScene::new(300, 240);
        let mut away = scene.pose.clone();
        let behind = nalgebra::Translation3::new(0.0, 0.0, -9.0);
        away.root = tryon_geometry::math::Rigid::new(behind * away.root.iso());
        let alone = agreement(&scene, &away, &scene.pose);
        assert_eq!((alone.in_free_space, alone.uncovered), (0.0, 1.0));
        let nobody = agreement(&scene, &away, &away);
        assert_eq!(nobody.wrong(), 0.0);
    }
}
