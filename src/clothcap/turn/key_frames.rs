//! Tracking of a recording, and the frames that show the subject at evenly spaced yaws.

use super::TurnError;
use super::frame_points::camera_points;
use crate::scan::BodyScan;
use crate::settings::TurnConfig;
use std::f64::consts::TAU;
use std::sync::Arc;
use tryon_body::{BodyShape, Pose, Template};
use tryon_geometry::camera::{Calibration, RgbdFrame};
use tryon_geometry::math::{Camera, P3, Rigid, V3, World};
use tryon_tracking::still::StillSteps;
use tryon_tracking::{
    PartClasses, TrackerConfig, TrackerModel, TrackerState, Workspace, yaw_of_joints,
};

/// Frame that shows the subject at one yaw.
#[derive(Clone, Debug)]
pub struct KeyFrame {
    /// Number in the recording, from 0.
    pub frame: usize,
    /// Yaw of the tracked body from facing the camera to its left, radians, within ±π.
    pub yaw: f64,
    /// Quality of the tracked pose, 0 to 1.
    pub quality: f64,
    /// Tracked pose.
    pub pose: Pose<Camera>,
    /// Points on the subject, camera frame, metres.
    pub points: BodyScan,
}

/// Key frames of a recording.
#[derive(Clone, Debug)]
pub struct KeyFrames {
    /// Key frames by yaw; never empty.
    pub frames: Vec<KeyFrame>,
    /// Shape that the tracker found, displacements included.
    pub shape: BodyShape,
    /// Upright world of the recording.
    pub world_from_camera: Rigid<World, Camera>,
    /// Frames of the recording.
    pub count: usize,
    /// Frames with a tracked subject.
    pub live: usize,
}

/// Tracks the frames of a recording in order and keeps the best one of each yaw.
pub struct TurnTracker {
    model: TrackerModel,
    state: TrackerState,
    workspace: Workspace,
    classes: PartClasses,
    best: Vec<Option<KeyFrame>>,
    count: usize,
    live: usize,
    settings: TurnConfig,
}

impl TurnTracker {
    /// Tracker before the first frame.
    pub fn new(template: Arc<Template>, calibration: Calibration) -> Self {
        let config = TrackerConfig {
            skip_unchanged: false,
            ..TrackerConfig::default()
        };
        let model = TrackerModel::new(template, calibration, config);
        let settings = TurnConfig::default();
        Self {
            state: TrackerState::new(&model),
            workspace: Workspace::default(),
            classes: PartClasses::new(model.template()),
            best: vec![None; settings.key_frames],
            settings,
            count: 0,
            live: 0,
            model,
        }
    }

    /// Tracks the next frame.
    ///
    /// # Errors
    /// [`TurnError::Frame`] for one that does not fit the camera.
    pub fn step(&mut self, frame: &RgbdFrame) -> Result<(), TurnError> {
        let is_first = self.count == 0;
        let (first_steps, interval_ns) = (self.settings.first_steps, self.settings.interval_ns);
        let steps = StillSteps {
            count: if is_first { first_steps } else { 1 },
            interval_ns,
        };
        let lead = if is_first { 0 } else { first_steps - 1 };
        let mut late = frame.clone();
        late.time_ns = late.time_ns.saturating_add(lead * interval_ns);
        let report = steps.run(&self.model, &mut self.state, &late, &mut self.workspace);
        let frame_of = |source| TurnError::Frame {
            frame: self.count,
            source,
        };
        let quality = report.map_err(frame_of)?.quality;
        if self.state.status.is_live() {
            self.live += 1;
            self.keep(frame, quality);
        }
        self.count += 1;
        Ok(())
    }

    /// Keeps the frame if it is the best one of its yaw.
    fn keep(&mut self, frame: &RgbdFrame, quality: f64) {
        let (posed, bones) = self.workspace.posed(&self.model, &self.state);
        let world = &self.state.world_from_camera;
        let up = world.inverse().vector(&nalgebra::Vector3::y());
        let yaw = yaw_of_joints(&self.classes, &bones.joints, &up.cast::<f32>()).unwrap_or(0.0);
        let bins = self.best.len();
        let bin = (yaw.rem_euclid(TAU) / TAU * bins as f64).round() as usize % bins;
        let before = self.best[bin].as_ref();
        if before.is_some_and(|b| b.quality >= quality) {
            return;
        }
        let floor = self.state.floor_known.then_some(world);
        let (calibration, settings) = (self.model.calibration(), &self.settings.points);
        let points = camera_points(frame, calibration, posed, floor, settings);
        self.best[bin] = Some(KeyFrame {
            frame: self.count,
            yaw,
            quality,
            pose: self.state.pose.clone(),
            points,
        });
    }

    /// Key frames of the recording.
    ///
    /// # Errors
    /// [`TurnError::Empty`], [`TurnError::Nobody`].
    pub fn finish(self) -> Result<KeyFrames, TurnError> {
        if self.count == 0 {
            return Err(TurnError::Empty);
        }
        let mut frames: Vec<KeyFrame> = self.best.into_iter().flatten().collect();
        frames.retain(|k| !k.points.points.is_empty());
        if frames.is_empty() {
            return Err(TurnError::Nobody { frames: self.count });
        }
        frames.sort_by(|a, b| a.yaw.total_cmp(&b.yaw));
        Ok(KeyFrames {
            frames,
            shape: self.state.shape,
            world_from_camera: self.state.world_from_camera,
            count: self.count,
            live: self.live,
        })
    }
}

/// Points and normals taken to another frame.
pub(super) fn moved<A, B>(scan: &BodyScan, to: &Rigid<A, B>) -> BodyScan {
    let iso: nalgebra::Isometry3<f32> = to.iso().cast();
    let points = scan.points.iter().map(|p: &P3| iso * p).collect();
    let normals = scan.normals.iter().map(|n: &V3| iso * n).collect();
    BodyScan {
        points,
        normals,
        ..scan.clone()
    }
}
