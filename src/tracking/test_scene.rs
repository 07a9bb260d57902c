//! The embedded body in its rest pose before a camera, and readings of it, for unit tests.

use super::state::TrackerState;
use crate::fit::FitContext;
use crate::model::{PersonalBody, TrackerModel};
use crate::registration::Observation;
use crate::segment::{Contour, contour};
use crate::settings::TrackerConfig;
use tryon_body::{BoneTransforms, Pose, RestBody, embedded, skin};
use tryon_geometry::camera::{Calibration, DepthImage, Intrinsics};
use tryon_geometry::math::{P3, P3d};
use tryon_geometry::par::Par;
use tryon_geometry::raster::{View, VisibilityBuffer, rasterise};
use tryon_geometry::spatial::{Label, OrganisedCloud, PointTree};

pub(super) struct TestScene {
    pub model: TrackerModel,
    pub rest: RestBody,
    pub pose: Pose,
}

impl TestScene {
    /// A tracker of `samples` points for a camera of `rows` rows.
    pub(super) fn new(samples: usize, rows: u32) -> Self {
        let config = TrackerConfig {
            samples,
            ..TrackerConfig::default()
        };
        let camera = Intrinsics {
            height: rows,
            ..Intrinsics::KINECT_V1
        };
        let calibration = Calibration::registered(camera);
        let model = TrackerModel::new(embedded::template(), calibration, config);
        Self {
            rest: model.template.personalise(&Default::default()),
            pose: TrackerState::new(&model).pose,
            model,
        }
    }

    /// The tracked body, of the mean shape.
    pub(super) fn body(&self) -> PersonalBody {
        let mut body = PersonalBody::default();
        body.update(&self.model, &Default::default());
        body
    }

    /// That `body` before readings.
    pub(super) fn context<'a>(
        &'a self,
        body: &'a PersonalBody,
        observation: &'a Observation<'a>,
    ) -> FitContext<'a> {
        FitContext {
            model: &self.model,
            body,
            observation,
        }
    }

    pub(super) fn bones(&self, pose: &Pose) -> BoneTransforms {
        let mut bones = BoneTransforms::default();
        pose.bones(self.model.template.skeleton(), &self.rest, &mut bones);
        bones
    }

    pub(super) fn joints(&self, pose: &Pose) -> Vec<P3d> {
        self.bones(pose).joints
    }

    /// Largest distance between the joints of two poses, metres.
    pub(super) fn distance(&self, a: &Pose, b: &Pose) -> f64 {
        let (a, b) = (self.joints(a), self.joints(b));
        let pairs = a.iter().zip(&b);
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    /// Depth image of the posed body without background.
    pub(super) fn depth(&self, pose: &Pose) -> DepthImage {
        let (template, camera) = (&self.model.template, self.model.calibration.depth);
        let (weights, bones) = (template.weights(), self.bones(pose));
        let mut vertices = Vec::new();
        skin(
            Par::Seq,
            &self.rest.vertices,
            weights,
            &bones,
            &mut vertices,
        );
        let view = View::Perspective { camera, near: 0.1 };
        let mut buffer = VisibilityBuffer::default();
        rasterise(&view, &vertices, template.mesh().faces(), &mut buffer);
        let mut image = DepthImage::empty(camera.width, camera.height);
        for (mm, z) in image.data_mut().iter_mut().zip(&buffer.depth) {
            *mm = if z.is_finite() {
                (z * 1e3).round() as u16
            } else {
                0
            };
        }
        image
    }
}

/// Readings of one depth image, all of them of the subject.
pub(super) struct DepthScan {
    grid: OrganisedCloud,
    cells: Vec<u32>,
    edges: Contour,
    tree: PointTree,
}

impl DepthScan {
    pub(super) fn new(model: &TrackerModel, image: &DepthImage) -> Self {
        let mut grid = OrganisedCloud::new(&model.calibration.depth, None);
        grid.sample(image, model.config.farthest);
        let all = 0..grid.depth.len() as u32;
        let cells: Vec<u32> = all.filter(|&c| grid.depth[c as usize] > 0.0).collect();
        for &c in &cells {
            grid.labels[c as usize] = Label::Person;
        }
        grid.refine(image, &cells);
        let mut edges = Contour::default();
        contour(&grid, &cells, &model.config.segment, &mut edges);
        let points: Vec<P3> = cells.iter().map(|&c| grid.points[c as usize]).collect();
        Self {
            tree: PointTree::new(&points),
            grid,
            cells,
            edges,
        }
    }

    /// Takes cells without a reading for background that was removed.
    pub(super) fn background_removed(mut self) -> Self {
        for (label, z) in self.grid.labels.iter_mut().zip(&self.grid.depth) {
            if *z == 0.0 {
                *label = Label::Background;
            }
        }
        self
    }

    pub(super) fn observation(&self) -> Observation<'_> {
        Observation {
            grid: &self.grid,
            cells: &self.cells,
            false_edges: &self.edges.false_edges,
            true_edges: &self.edges.true_edges,
            tree: Some(&self.tree),
        }
    }
}

impl Default for TestScene {
    fn default() -> Self {
        Self::new(50, Intrinsics::KINECT_V1.height)
    }
}
