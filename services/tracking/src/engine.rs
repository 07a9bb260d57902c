//! Tracker of a session and the wire form of its states.

use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::time::Instant;
use tryon_body::{BodyShape, Template, embedded, import};
use tryon_formats::MeshFrame;
use tryon_geometry::camera::{Calibration, Intrinsics, RgbdFrame};
use tryon_kit::frames::{Exposure, stage};
use tryon_kit::telemetry::record_skipped;
use tryon_landmarks::Landmarker;
use tryon_proto::convert::{body, geometry};
use tryon_proto::v1::{self, DegradedReason, TrackingStatus};
use tryon_tracking::{
    BackgroundEye, KnownBody, LostReason, Status, TrackerConfig, TrackerModel, TrackerState,
    Workspace, adapt_surface, follow,
};

/// Configured template: an SMPL-layout npz, or the embedded body for an empty path.
pub(crate) fn load_template(path: &Path) -> Result<Arc<Template>, String> {
    if path.as_os_str().is_empty() {
        return Ok(embedded::template());
    }
    let body = import::read_body(path, &MeshFrame::default()).map_err(|e| e.to_string())?;
    for note in &body.notes {
        tracing::info!(body = %path.display(), "{note}");
    }
    Ok(Arc::new(body.template))
}

/// Tracker model of the configured template, made once and beside the start of the service: it takes as long as several
/// frames.
#[derive(Clone)]
pub(crate) struct PreparedModel {
    made: Arc<OnceLock<TrackerModel>>,
    template: Arc<Template>,
    /// Networks of the eye for colour.
    landmarker: Option<Landmarker>,
}

impl PreparedModel {
    /// A model that is not made yet.
    pub(crate) fn new(template: Arc<Template>, landmarker: Option<Landmarker>) -> Self {
        Self {
            made: Arc::default(),
            template,
            landmarker,
        }
    }

    /// Makes it, unless that has been done.
    pub(crate) fn make(&self) -> &TrackerModel {
        self.made.get_or_init(|| {
            let any = Calibration::registered(Intrinsics::KINECT_V1);
            TrackerModel::new(self.template.clone(), any, TrackerConfig::default())
        })
    }

    /// The model for a camera.
    fn for_camera(&self, calibration: Calibration) -> TrackerModel {
        self.make().with_calibration(calibration)
    }

    /// An eye for colour beside a camera; `None` without the model.
    fn eye(&self, calibration: &Calibration) -> Option<BackgroundEye> {
        let landmarker = self.landmarker.clone()?;
        let eye = BackgroundEye::start(landmarker, calibration.clone());
        eye.inspect_err(|why| tracing::warn!(%why, "no thread for the eye for colour: depth alone"))
            .ok()
    }
}

/// One session's tracker for one calibration.
pub(crate) struct Engine {
    eye: Option<BackgroundEye>,
    model: TrackerModel,
    state: TrackerState,
    work: Workspace,
    epoch: u64,
    calibration: Arc<Calibration>,
    shape: BodyShape,
    wire_shape: v1::BodyShape,
    counts: SessionCounts,
}

/// Counts of a session that go on from engine to engine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SessionCounts {
    /// Changes of the shape.
    shape_version: u64,
    /// Bodies that were measured from nothing.
    subject: u64,
}

impl Engine {
    /// A tracker that searches. `counts` are those of an earlier engine of the session.
    pub(crate) fn new(
        prepared: &PreparedModel,
        calibration: Arc<Calibration>,
        epoch: u64,
        counts: SessionCounts,
    ) -> Self {
        let eye = prepared.eye(&calibration);
        let model = prepared.for_camera(calibration.as_ref().clone());
        let mut state = TrackerState::new(&model);
        state.subject = counts.subject;
        let (shape, wire_shape) = (BodyShape::default(), v1::BodyShape::default());
        let work = Workspace::default();
        Self {
            eye,
            model,
            state,
            work,
            epoch,
            calibration,
            shape,
            wire_shape,
            counts,
        }
    }

    /// The exposure is of the same run of the same camera.
    pub(crate) fn is_for(&self, e: &Exposure) -> bool {
        self.epoch == e.id.epoch
            && (Arc::ptr_eq(&self.calibration, &e.calibration) || self.calibration == e.calibration)
    }

    pub(crate) fn counts(&self) -> SessionCounts {
        SessionCounts {
            subject: self.state.subject,
            ..self.counts
        }
    }

    /// Forgets body and pose.
    pub(crate) fn reset(&mut self) {
        self.state.reset(&self.model);
    }

    /// Goes on with a body that was measured before; false when it has one.
    pub(crate) fn know(&mut self, known: &KnownBody) -> bool {
        self.state.know(&self.model, known)
    }

    /// Body whose size has settled.
    pub(crate) fn known_body(&self) -> Option<KnownBody> {
        self.state.known_body(&self.model)
    }

    /// Knows a body of which nobody was found yet.
    pub(crate) fn is_known_awaited(&self) -> bool {
        self.state.is_known_awaited()
    }

    /// Adapts the surface to the exposure of the last step, when that is due: the next step has it.
    pub(crate) fn adapt(&mut self) {
        let begun = Instant::now();
        if adapt_surface(&self.model, &mut self.state, &mut self.work) > 0 {
            metrics::histogram!("tryon_stage_ms", "stage" => "tracking.surface")
                .record(begun.elapsed().as_secs_f64() * 1e3);
        }
    }

    /// Tells the tracker what the eye for colour saw a moment ago, and shows it this frame.
    fn look(&mut self, frame: &RgbdFrame) {
        match self.eye.as_mut().map(|eye| eye.exchange(frame)) {
            Some(Ok(Some(sighting))) => {
                metrics::counter!("tryon_tracking_sightings").increment(1);
                self.state.see(sighting);
            }
            Some(Err(why)) => {
                tracing::warn!(%why, "the eye for colour is closed: depth alone");
                self.eye = None;
            }
            Some(Ok(None)) | None => {}
        }
    }

    /// Tracks one exposure; the wire form of the state. [`Self::adapt`] is to follow.
    pub(crate) fn step(&mut self, e: &Exposure) -> v1::BodyState {
        let start = Instant::now();
        self.look(&e.rgbd);
        let report = follow(&self.model, &mut self.state, &e.rgbd, &mut self.work);
        let mut stages = e.stages.clone();
        let mut state = v1::BodyState {
            frame: Some(e.id),
            age_frames: self.state.pose_age,
            subject: self.state.subject,
            ..Default::default()
        };
        match report {
            Ok(r) => {
                let of = |name: &str, ms: f64| v1::StageTime {
                    stage: format!("tracking.{name}"),
                    ms: ms as f32,
                };
                let s = &r.stages_ms;
                stages.extend([
                    of("segment", s.segment),
                    of("pose", s.place + s.pose),
                    of("shape", s.size),
                    of("assess", s.assess + s.repair),
                ]);
                (state.residual_mm, state.visible_points) =
                    (r.residual_mm as f32, r.visible_points as u32);
                record_skipped("tracking", r.skipped.counts());
                state.iterations = r.iterations as u32;
                let (status, reason) = status_to_wire(self.state.status);
                state.set_status(status);
                state.set_reason(reason);
            }
            Err(why) => {
                state.set_status(TrackingStatus::Lost);
                state.set_reason(DegradedReason::StepFailed);
                state.detail = why.to_string();
            }
        }
        if state.status() != TrackingStatus::Searching {
            if self.counts.shape_version == 0 || self.shape != self.state.shape {
                self.shape = self.state.shape.clone();
                self.wire_shape = body::shape_to_wire(&self.shape);
                self.counts.shape_version += 1;
            }
            state.pose = Some(body::pose_to_wire(&self.state.pose));
            state.shape = Some(self.wire_shape.clone());
            state.shape_version = self.counts.shape_version;
            let sure = self.state.girth_deviations(&self.model);
            state.girth_deviations = sure.map(|d| v1::GirthDeviations {
                chest: d.chest as f32,
                waist: d.waist as f32,
                hip: d.hip as f32,
            });
        }
        state.world_from_camera = Some(geometry::rigid_to_wire(&self.state.world_from_camera));
        stages.push(stage("tracking.total", start));
        state.stages = stages;
        state
    }
}

fn status_to_wire(status: Status) -> (TrackingStatus, DegradedReason) {
    match status {
        Status::Searching => (TrackingStatus::Searching, DegradedReason::NoPerson),
        Status::Calibrating => (TrackingStatus::Calibrating, DegradedReason::Unspecified),
        Status::Tracking => (TrackingStatus::Tracking, DegradedReason::Unspecified),
        Status::Sitting => (TrackingStatus::Sitting, DegradedReason::PersonSits),
        Status::Lost { reason } => {
            let why = match reason {
                LostReason::NoPerson => DegradedReason::PersonLeft,
                LostReason::Thing => DegradedReason::NoPerson,
                LostReason::Residual | LostReason::Disagreement => DegradedReason::TrackingLost,
                LostReason::NotFinite => DegradedReason::StepFailed,
            };
            (TrackingStatus::Lost, why)
        }
    }
}
