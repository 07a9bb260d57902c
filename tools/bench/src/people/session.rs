//! One tracked session of the bench: frames in, common joints out.

use super::common_joints::{CommonJoints, Points};
use nalgebra::Rotation3;
use std::sync::Arc;
use tryon_body::{BoneTransforms, Template};
use tryon_geometry::camera::{Calibration, DepthImage, RgbdFrame};
use tryon_tracking::{TrackerConfig, TrackerModel, TrackerState, Workspace, step};

/// Time between frames at 30 a second, nanoseconds.
pub(super) const FRAME_NS: u64 = 33_333_333;

/// A tracker with its state, started from nothing.
pub(super) struct TrackedSession {
    pub(super) model: TrackerModel,
    pub(super) state: TrackerState,
    workspace: Workspace,
    common: CommonJoints,
    interval_ns: u64,
    frames: u64,
}

impl TrackedSession {
    /// A session at 30 frames a second.
    pub(super) fn new(template: &Arc<Template>, calibration: &Calibration) -> Self {
        let model = TrackerModel::new(
            template.clone(),
            calibration.clone(),
            TrackerConfig::default(),
        );
        Self {
            state: TrackerState::new(&model),
            workspace: Workspace::default(),
            common: CommonJoints::new(template.skeleton()),
            interval_ns: FRAME_NS,
            frames: 0,
            model,
        }
    }
    /// The same with another time between frames, nanoseconds.
    pub(super) fn with_interval(mut self, interval_ns: u64) -> Self {
        self.interval_ns = interval_ns;
        self
    }
    /// Tracks the next frame; `true` with a live pose.
    pub(super) fn advance(&mut self, depth: DepthImage) -> bool {
        let frame = RgbdFrame {
            sequence: self.frames,
            time_ns: self.frames * self.interval_ns,
            depth,
            color: None,
        };
        self.frames += 1;
        let stepped = step(&self.model, &mut self.state, &frame, &mut self.workspace);
        stepped.is_ok() && self.state.status.is_live()
    }
    /// Tracks the next frame; its common joints with a live pose.
    pub(super) fn track(&mut self, depth: DepthImage) -> Option<Points> {
        self.advance(depth).then(|| self.points())
    }
    /// Orientation of the chest's bone in the camera frame: the uppermost joint of the spine.
    pub(super) fn chest_turn(&mut self) -> Rotation3<f64> {
        let skeleton = self.model.template().skeleton();
        let chest = ["spine3", "spine2", "spine1"];
        let chest = chest.iter().find_map(|n| skeleton.index(n)).unwrap_or(0);
        self.bones().bones[chest].rotation.to_rotation_matrix()
    }
    fn bones(&mut self) -> BoneTransforms {
        let rest = self.workspace.rest_body(&self.model, &self.state.shape);
        let mut bones = BoneTransforms::default();
        let skeleton = self.model.template().skeleton();
        self.state.pose.bones(skeleton, rest, &mut bones);
        bones
    }
    /// Common joints of the last pose.
    pub(super) fn points(&mut self) -> Points {
        let joints = self.bones().joints;
        self.common.points(&joints)
    }
}
