//! What a tracker remembers from frame to frame.

use super::rescue::Rescue;
use super::size::SizeEstimate;
use super::stand::Feet;
use super::surface::SurfaceStatistics;
use super::unchanged::Reference;
use super::{TrackerConfig, TrackerModel};
use crate::body::{BodyShape, Pose};
use crate::math::{Camera, P3, Rigid, World};
use crate::segment::ScenePlanes;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Why there is no live pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LostReason {
    /// Nothing of a body's size was seen.
    NoPerson,
    /// The body no longer explains what is seen.
    Residual,
    /// The numbers of a step were not finite; its result was thrown away.
    NotFinite,
}

/// Where the tracker is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Nobody has been found yet.
    Searching,
    /// A person is tracked; size and shape still change.
    Calibrating,
    /// A person is tracked.
    Tracking,
    /// The person was lost; the last good pose is kept.
    Lost {
        /// Why.
        reason: LostReason,
    },
}

impl Status {
    /// A pose of this very frame exists.
    pub fn is_live(&self) -> bool {
        matches!(self, Self::Calibrating | Self::Tracking)
    }
}

/// The state of one tracked session. Saving and restoring it between two steps changes no bit of what follows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackerState {
    /// Where the tracker is.
    pub status: Status,
    /// Last good pose; the rest pose before anybody was found.
    pub pose: Pose<Camera>,
    /// The person's shape.
    pub shape: BodyShape,
    /// The upright room: y up, floor at y = 0 when a floor was seen.
    pub world_from_camera: Rigid<World, Camera>,
    /// The floor is known, so that world heights are true heights.
    pub floor_known: bool,
    /// Frames since `pose` was measured; 0 when it is of the last frame.
    pub pose_age: u32,
    /// Frames seen.
    pub frames: u64,
    pub(super) scene: ScenePlanes,
    pub(super) scene_age: Option<u32>,
    /// Pose before `pose`, for prediction.
    pub(super) before: Option<Pose<Camera>>,
    pub(super) time_ns: u64,
    /// Time between `before` and `pose`.
    pub(super) interval_ns: u64,
    pub(super) size: SizeEstimate,
    pub(super) surface: SurfaceStatistics,
    pub(super) bad_frames: u32,
    /// Frames in a row in which the root hardly moved.
    pub(super) steady: u32,
    /// Frames since the person was found.
    pub(super) calibration_age: u32,
    /// Middle of what was seen of the person, camera frame.
    pub(super) centre: P3,
    /// How the last pose fitted its frame: share of explained readings, residual in metres.
    pub(super) quality: [f64; 2],
    /// Greatest height of the hips so far along the upright, camera frame, metres.
    #[serde(default)]
    pub(super) tallest: Option<f64>,
    /// Running mean of the way from the last pose's joints to each fit's, camera frame, metres; empty at a start.
    #[serde(default)]
    pub(super) drift: Vec<Vector3<f64>>,
    /// Where the feet stood.
    #[serde(default)]
    pub(super) feet: Option<Feet>,
    #[serde(default)]
    pub(super) rescue: Rescue,
    /// Frames in a row that were gone through and in which hardly anything moved.
    #[serde(default)]
    pub(super) still: u32,
    /// What a picture is compared with while the person stands still or nobody is there.
    #[serde(default)]
    pub(super) unchanged: Option<Reference>,
    /// Frames until displacements are due, and the interval between fits.
    pub(super) surface_due: [u32; 2],
}

/// Height of a camera whose floor is not in view, metres; kiosks mount it at about this height.
const ASSUMED_HEIGHT: f64 = 1.2;

impl TrackerState {
    /// Nobody seen yet.
    pub fn new(model: &TrackerModel) -> Self {
        // Facing the camera at 2 m: turned by half a turn about x, as the camera's y points down.
        let facing = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let root = Rigid::from_parts(Vector3::new(0.0, 0.9, 2.0), facing);
        let world_from_camera = ScenePlanes::default().world_from_camera(ASSUMED_HEIGHT);
        Self {
            status: Status::Searching,
            pose: Pose::rest(model.template().skeleton(), root),
            shape: BodyShape::default(),
            world_from_camera,
            floor_known: false,
            pose_age: 0,
            frames: 0,
            scene: ScenePlanes::default(),
            scene_age: None,
            before: None,
            time_ns: 0,
            interval_ns: 0,
            size: SizeEstimate::default(),
            surface: SurfaceStatistics::default(),
            bad_frames: 0,
            steady: 0,
            calibration_age: 0,
            centre: P3::origin(),
            quality: [0.0; 2],
            tallest: None,
            drift: Vec::new(),
            feet: None,
            rescue: Rescue::default(),
            still: 0,
            unchanged: None,
            surface_due: [0; 2],
        }
    }
    /// Starts from a rough placement instead of searching: the root joint at `root` (camera frame, metres), upright,
    /// facing the camera turned by `yaw` radians about the vertical. Alignment takes it from there.
    pub fn start_at(&mut self, model: &TrackerModel, root: Vector3<f64>, yaw: f64) {
        let facing = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let turned = facing * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), yaw);
        let skeleton = model.template().skeleton();
        let pelvis = skeleton.joints()[0].rest.coords;
        self.pose = Pose::rest(skeleton, Rigid::from_parts(root - turned * pelvis, turned));
        self.status = Status::Calibrating;
        self.centre = P3::from(root.cast::<f32>());
        self.before = None;
        self.unchanged = None;
        self.pose_age = 0;
    }
    /// Forgets the person, keeps the room.
    pub fn reset(&mut self, model: &TrackerModel) {
        let fresh = Self::new(model);
        *self = Self {
            world_from_camera: self.world_from_camera,
            floor_known: self.floor_known,
            scene: self.scene.clone(),
            scene_age: self.scene_age,
            frames: self.frames,
            ..fresh
        };
    }
    pub(super) fn set_scene(&mut self, scene: ScenePlanes) {
        self.floor_known = scene.floor.is_some();
        self.world_from_camera = scene.world_from_camera(ASSUMED_HEIGHT);
        self.scene = scene;
        self.scene_age = Some(0);
    }
    /// Size and shape no longer change.
    pub(super) fn calibrated(&self, config: &TrackerConfig) -> bool {
        !config.adapt_size || self.size.frames >= config.calibration_frames
    }
}
