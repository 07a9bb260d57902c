//! The embedded body in its rest pose before a camera, for unit tests.

use super::{TrackerConfig, TrackerModel, TrackerState};
use crate::body::{BoneTransforms, Pose, RestBody, embedded};
use crate::camera::{Calibration, Intrinsics};
use crate::math::P3d;

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

    pub(super) fn bones(&self, pose: &Pose) -> BoneTransforms {
        let mut bones = BoneTransforms::default();
        pose.bones(self.model.template.skeleton(), &self.rest, &mut bones);
        bones
    }

    pub(super) fn joints(&self, pose: &Pose) -> Vec<P3d> {
        self.bones(pose).joints
    }
}

impl Default for TestScene {
    fn default() -> Self {
        Self::new(50, Intrinsics::KINECT_V1.height)
    }
}
