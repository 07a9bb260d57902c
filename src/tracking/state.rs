//! State of a tracker from frame to frame.

use super::change_detection::DepthReference;
use super::clothes_colors::ClothesColors;
use super::own_motion::{StillSubject, StillThing};
use super::status::{LostReason, Status};
use crate::assess::{FacingBelief, PersonBelief, Seat};
use crate::fit::{FootMemory, RecentPoses};
use crate::model::TrackerModel;
use crate::recover::RepairTimer;
use crate::segment::{Refusals, ScenePlanes};
use crate::settings::TrackerConfig;
use crate::shape::{Probation, SizeEstimate, SurfaceStatistics};
use crate::sighting::ColorSighting;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use tryon_body::{BodyShape, Pose};
use tryon_geometry::math::{Camera, P3, Rigid, World};

/// The state of one tracked session. Saving and restoring it between two steps changes no bit of what follows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackerState {
    /// Status.
    pub status: Status,
    /// Last good pose; the rest pose before any.
    pub pose: Pose<Camera>,
    /// Shape of the subject.
    pub shape: BodyShape,
    /// Upright world: y up, floor at y = 0 when a floor was found.
    pub world_from_camera: Rigid<World, Camera>,
    /// True with a known floor: world heights are true heights.
    pub floor_known: bool,
    /// Frames since `pose` was measured; 0 for a pose of the last frame.
    pub pose_age: u32,
    /// Frames processed.
    pub frames: u64,
    /// Number of subjects measured so far: it grows with each body whose size is measured from nothing.
    #[serde(default)]
    pub subject: u64,
    pub(super) scene: ScenePlanes,
    /// Frames since `scene` was found.
    pub(super) scene_age: Option<u32>,
    /// Pose before `pose`, for prediction.
    pub(super) before: Option<Pose<Camera>>,
    pub(super) time_ns: u64,
    /// Time between `before` and `pose`.
    pub(super) interval_ns: u64,
    pub(super) size: SizeEstimate,
    /// Comparison with a body that was measured before, until it is over.
    #[serde(default)]
    pub(super) probation: Option<Probation>,
    /// Colours of the subject's clothes; `None` before they were seen.
    #[serde(default)]
    pub(super) clothes: Option<ClothesColors>,
    pub(super) surface: SurfaceStatistics,
    pub(super) bad_frames: u32,
    /// Frames in a row in which the body disagreed with the frame.
    #[serde(default)]
    pub(super) disagreeing: u32,
    /// Candidates that were nobody.
    #[serde(default)]
    pub(super) refusals: Refusals,
    /// Test whether the subject is a person.
    #[serde(default)]
    pub(super) belief: PersonBelief,
    /// The subject is followed, but maybe nobody, or turned around: not live.
    #[serde(default)]
    pub(super) is_unsure: bool,
    /// Watch over a subject that has not moved yet.
    #[serde(default)]
    pub(super) still_subject: Option<StillSubject>,
    /// Subjects that never moved, and still stand there.
    #[serde(default)]
    pub(super) things: Vec<StillThing>,
    /// Person seen in colour since the last step.
    #[serde(default)]
    pub(super) sighting: Option<ColorSighting>,
    /// Test of the subject's facing; `None` without a subject.
    #[serde(default)]
    pub(super) facing: Option<FacingBelief>,
    /// Mean of the subject's readings, camera frame, metres.
    pub(super) centre: P3,
    /// Fit of the last pose: share of explained readings, residual in metres.
    pub(super) quality: [f64; 2],
    /// Greatest height of the hips so far along the upright, camera frame, metres.
    #[serde(default, rename = "tallest")]
    pub(super) highest_hips: Option<f64>,
    /// Running mean of the displacement from the last pose's joints to each fit's, camera frame, metres; empty at a start.
    #[serde(default)]
    pub(super) drift: Vec<Vector3<f64>>,
    /// Remembered places of the feet.
    #[serde(default)]
    pub(super) feet: Option<FootMemory>,
    /// Posture of the subject.
    #[serde(default)]
    pub(super) seat: Seat,
    #[serde(default)]
    pub(super) repair: RepairTimer,
    /// Processed frames in a row in which hardly anything moved.
    #[serde(default)]
    pub(super) still: u32,
    /// Reference of the change detection while the subject is at rest or absent.
    #[serde(default, rename = "unchanged")]
    pub(super) reference: Option<DepthReference>,
    /// Frames until the next update of displacements, and the interval between updates.
    pub(super) surface_due: [u32; 2],
}

/// Root of the rest pose before any was found, camera frame, metres: standing at 2 m.
const START: Vector3<f64> = Vector3::new(0.0, 0.9, 2.0);

/// Rotation of an upright body that faces the camera: half a turn about x, as the camera's y points down.
fn facing_camera() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
}

impl TrackerState {
    /// State before the first frame.
    pub fn new(model: &TrackerModel) -> Self {
        let root = Rigid::from_parts(START, facing_camera());
        let world_from_camera =
            ScenePlanes::default().world_from_camera(model.config.start.assumed_height);
        Self {
            status: Status::Searching,
            pose: Pose::rest(model.template().skeleton(), root),
            shape: BodyShape::default(),
            world_from_camera,
            floor_known: false,
            pose_age: 0,
            frames: 0,
            subject: 0,
            scene: ScenePlanes::default(),
            scene_age: None,
            before: None,
            time_ns: 0,
            interval_ns: 0,
            size: SizeEstimate::default(),
            probation: None,
            clothes: None,
            surface: SurfaceStatistics::default(),
            bad_frames: 0,
            disagreeing: 0,
            refusals: Refusals::default(),
            belief: PersonBelief::default(),
            facing: None,
            still_subject: None,
            things: Vec::new(),
            sighting: None,
            is_unsure: false,
            centre: P3::origin(),
            quality: [0.0; 2],
            highest_hips: None,
            drift: Vec::new(),
            feet: None,
            seat: Seat::default(),
            repair: RepairTimer::default(),
            still: 0,
            reference: None,
            surface_due: [0; 2],
        }
    }
    /// Searches around a rough place first, for somebody upright: the root joint at `root` (camera frame, metres), facing the
    /// camera and turned by `yaw` radians about the vertical.
    pub fn start_at(&mut self, model: &TrackerModel, root: Vector3<f64>, yaw: f64) {
        let turned = facing_camera() * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), yaw);
        let skeleton = model.template().skeleton();
        let pelvis = skeleton.joints()[0].rest.coords;
        self.pose = Pose::rest(skeleton, Rigid::from_parts(root - turned * pelvis, turned));
        self.status = Status::Lost {
            reason: LostReason::NoPerson,
        };
        self.belief = PersonBelief::given(&model.config.assess.belief);
        self.facing = Some(FacingBelief::given(&model.config.assess.facing));
        self.centre = P3::from(root.cast::<f32>());
        self.before = None;
        self.reference = None;
        self.pose_age = 0;
    }
    /// Takes what an eye for colour saw in this frame or a moment before; the next step uses it if it is of the subject.
    pub fn see(&mut self, sighting: ColorSighting) {
        self.sighting = Some(sighting);
    }
    /// Forgets the subject, keeps the scene.
    pub fn reset(&mut self, model: &TrackerModel) {
        let fresh = Self::new(model);
        *self = Self {
            world_from_camera: self.world_from_camera,
            floor_known: self.floor_known,
            scene: self.scene.clone(),
            scene_age: self.scene_age,
            refusals: self.refusals.clone(),
            things: self.things.clone(),
            frames: self.frames,
            subject: self.subject,
            ..fresh
        };
    }
    pub(super) fn set_scene(&mut self, scene: ScenePlanes, config: &TrackerConfig) {
        self.floor_known = scene.floor.is_some();
        self.world_from_camera = scene.world_from_camera(config.start.assumed_height);
        self.scene = scene;
        self.scene_age = Some(0);
    }
    /// True with a pose to follow: live, or in doubt for a few frames.
    pub(super) fn is_following(&self) -> bool {
        self.status.is_live() || self.disagreeing > 0 || self.is_unsure
    }
    /// True once the girths have settled: a size of a garment can be chosen. Size and shape may still change a little.
    pub fn is_sized(&self, config: &TrackerConfig) -> bool {
        self.size.is_settled || self.calibrated(config)
    }
    /// True once the first frames have been used: later ones change size and shape only by views of the body that are new.
    pub(super) fn calibrated(&self, config: &TrackerConfig) -> bool {
        !config.adapt_size || self.size.frames >= config.calibration_frames
    }
    /// Status of a live pose: `Sitting` for who sits; `Calibrating` until the size has settled, then `Tracking`.
    pub(super) fn live_status(&self, config: &TrackerConfig) -> Status {
        if self.seat.is_taken {
            Status::Sitting
        } else if self.is_sized(config) {
            Status::Tracking
        } else {
            Status::Calibrating
        }
    }
    /// Poses from which the next one is predicted.
    pub(super) fn recent_poses(&self, config: &TrackerConfig) -> RecentPoses<'_> {
        RecentPoses {
            last: &self.pose,
            before: self.before.as_ref(),
            time_ns: self.time_ns,
            interval_ns: self.interval_ns,
            quality: self.quality,
            is_calibrated: self.calibrated(config),
        }
    }
}
