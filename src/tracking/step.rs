//! One frame (Algorithm 1): segment → track the subject → keep a reference for change detection → adapt the surface.

use super::adaptation::adapt_surface;
use super::block_readings::BlockReadings;
use super::change_detection::DepthReference;
use super::own_motion::{OwnMotion, StillSubject, StillThing};
use super::report::{StepError, StepReport, Stopwatch};
use super::segmentation::segment;
use super::state::TrackerState;
use super::status::{LostReason, Status};
use super::subject::{StepLog, SubjectFrame};
use super::workspace::Workspace;
use crate::fit::motion;
use crate::model::TrackerModel;
use crate::registration::Observation;
use crate::segment::{CandidateBox, PersonSearch};
use crate::start::{person_cells, rolled_camera};
use nalgebra::Vector3;
use tryon_geometry::camera::RgbdFrame;
use tryon_geometry::spatial::OrganisedCloud;

/// Tracks one frame. On success the state holds the newest pose and status. A frame without a usable subject keeps the
/// last good pose and its reason.
///
/// # Errors
/// When the image does not fit the calibration or the state the template, or calibration, shape or camera pose are not
/// finite; the state is unchanged.
pub fn step(
    model: &TrackerModel,
    state: &mut TrackerState,
    frame: &RgbdFrame,
    workspace: &mut Workspace,
) -> Result<StepReport, StepError> {
    let mut report = follow(model, state, frame, workspace)?;
    let mut watch = Stopwatch::start();
    let updated = adapt_surface(model, state, workspace);
    if updated > 0 {
        report.skipped.displacements = state.shape.displacements.len() - updated;
    }
    report.stages_ms.surface = watch.lap();
    Ok(report)
}

/// First half of [`step`]: pose, status and size. [`adapt_surface`] is the second; without it displacements stay.
///
/// # Errors
/// As [`step`].
pub fn follow(
    model: &TrackerModel,
    state: &mut TrackerState,
    frame: &RgbdFrame,
    workspace: &mut Workspace,
) -> Result<StepReport, StepError> {
    check(model, state, frame)?;
    workspace.surface_cells = None;
    let mut watch = Stopwatch::start();
    if let Some(mut report) = reuse(model, state, frame) {
        report.stages_ms.segment = watch.lap();
        return Ok(report);
    }
    state.reference = None;
    let (camera, stride) = (&model.calibration.depth, model.config.stride);
    let cached = workspace.grid.take().filter(|g| g.fits(camera, stride));
    let mut grid = cached.unwrap_or_else(|| OrganisedCloud::new(camera, stride));
    state.frames += 1;
    let person = segment(model, state, frame, &mut grid, workspace);
    let seen = SegmentedFrame {
        frame,
        grid: &grid,
        person: &person,
    };
    let mut log = StepLog::new(state, &grid, &person, watch);
    let nobody = person.cells.len() < model.config.segment.least_cells;
    if nobody {
        lose(state, LostReason::NoPerson);
    } else {
        seen.track(model, state, workspace, &mut log);
    }
    let mut report = log.finish();
    report.status = state.status;
    report.pose_age = state.pose_age;
    if model.config.skip_unchanged {
        state.reference = seen.reference(model, state, &report);
    }
    workspace.grid = Some(grid);
    Ok(report)
}

/// Frame with its grid and the person in it.
struct SegmentedFrame<'a> {
    frame: &'a RgbdFrame,
    grid: &'a OrganisedCloud,
    person: &'a PersonSearch,
}

impl SegmentedFrame<'_> {
    /// Tracks the subject; remembers a candidate that was nobody.
    fn track(
        &self,
        model: &TrackerModel,
        state: &mut TrackerState,
        workspace: &mut Workspace,
        log: &mut StepLog,
    ) {
        let (frame, grid, person) = (self.frame, self.grid, self.person);
        let contour = std::mem::take(&mut workspace.contour);
        let tree = model.point_tree(grid, &person.cells);
        let observation = Observation {
            grid,
            cells: &person.cells,
            false_edges: &contour.false_edges,
            true_edges: &contour.true_edges,
            tree: tree.as_ref(),
        };
        let is_new = !state.is_following();
        if is_new && !state.floor_known {
            let scratch = &mut workspace.parts;
            state.world_from_camera = rolled_camera(model, &observation, scratch);
        }
        let up = state.world_from_camera.inverse().vector(&Vector3::y());
        let cells = person_cells(&observation, &up);
        let settings = &model.config.assess.sighting;
        let sighting = state.sighting.take();
        let subject = SubjectFrame {
            model,
            frame,
            person,
            observation,
            up,
            sighting: sighting.filter(|s| s.is_of(&cells, frame.time_ns, settings)),
        };
        match subject.track_known(state, workspace, log) {
            Ok(()) => {
                let is_tested = !state.is_unsure;
                self.watch(model, state, is_new);
                if let Some(candidate) = person.candidate.filter(|_| is_tested) {
                    let settings = &model.config.segment.refusals;
                    state.refusals.forget(&candidate, settings);
                }
            }
            Err(reason) => {
                if let Some(candidate) = person.candidate {
                    refuse(model, state, candidate, reason);
                }
                lose(state, reason);
            }
        }
        workspace.contour = contour;
    }

    /// Watches a subject that hasn't moved yet; one that never does is a thing.
    fn watch(&self, model: &TrackerModel, state: &mut TrackerState, is_new: bool) {
        let settings = &model.config.step;
        let (depth, time_ns) = (&self.frame.depth, self.frame.time_ns);
        if is_new {
            let cells = &self.person.cells;
            let readings = BlockReadings::within_cells(depth, self.grid, cells);
            state.still_subject = Some(StillSubject::new(readings, time_ns));
            return;
        }
        let Some(mut subject) = state.still_subject.take() else {
            return;
        };
        match (
            subject.watch(depth, time_ns, settings),
            self.person.candidate,
        ) {
            (OwnMotion::Moved, _) => {}
            (OwnMotion::Never, Some(candidate)) => {
                state
                    .things
                    .truncate(settings.most_things.saturating_sub(1));
                state.things.insert(0, StillThing::new(candidate, subject));
                state.reset(model);
            }
            _ => state.still_subject = Some(subject),
        }
    }

    /// Reference of later frames, which are skipped while nothing changes.
    fn reference(
        &self,
        model: &TrackerModel,
        state: &mut TrackerState,
        report: &StepReport,
    ) -> Option<DepthReference> {
        let (grid, cells) = (self.grid, &self.person.cells);
        let depth = &self.frame.depth;
        if cells.len() >= model.config.segment.least_cells {
            return is_at_rest(model, state)
                .then(|| DepthReference::of_cells(depth, grid, cells, report));
        }
        // A waiting candidate is tried again though nothing changes.
        let step = model.config.step.empty_stride * grid.stride();
        (self.person.rivals == 0).then(|| DepthReference::of_image(depth, step, report))
    }
}

fn check(model: &TrackerModel, state: &TrackerState, frame: &RgbdFrame) -> Result<(), StepError> {
    let camera = &model.calibration.depth;
    let (got, expected) = (
        (frame.depth.width(), frame.depth.height()),
        (camera.width, camera.height),
    );
    if got != expected {
        return Err(StepError::ImageSize { got, expected });
    }
    let (got, expected) = (state.pose.angles.len(), model.template.skeleton().dofs());
    if got != expected {
        return Err(StepError::ForeignState { got, expected });
    }
    let shape = &state.shape;
    let sizes = shape.coefficients.iter().chain(&shape.bone_scales);
    let fields = [
        (
            "calibration.depth",
            [camera.fx, camera.fy, camera.cx, camera.cy]
                .iter()
                .all(|v| v.is_finite()),
        ),
        (
            "state.world_from_camera",
            state.world_from_camera.is_finite(),
        ),
        ("state.shape", sizes.into_iter().all(|v| v.is_finite())),
        (
            "state.shape.displacements",
            shape.displacements.iter().all(|v| v.is_finite()),
        ),
    ];
    match fields.into_iter().find(|(_, is_finite)| !is_finite) {
        Some((field, _)) => Err(StepError::NotFinite { field }),
        None => Ok(()),
    }
}

/// Report of a frame without change: pose and report of the reference frame hold.
fn reuse(model: &TrackerModel, state: &mut TrackerState, frame: &RgbdFrame) -> Option<StepReport> {
    let settings = &model.config.step.change;
    let reference = state.reference.as_mut()?;
    let mut report = reference.reuse(&frame.depth, settings)?.clone();
    state.frames += 1;
    state.scene_age = state.scene_age.map(|a| a.saturating_add(1));
    if !state.status.is_live() {
        lose(state, LostReason::NoPerson);
    }
    report.status = state.status;
    report.pose_age = state.pose_age;
    report.iterations = 0;
    report.skipped.frames = 1;
    report.skipped.displacements = state.shape.displacements.len();
    Some(report)
}

/// True when the subject rests in a settled pose, so that an unchanged frame has the same result; counts such frames.
fn is_at_rest(model: &TrackerModel, state: &mut TrackerState) -> bool {
    let settings = &model.config.step;
    let moved = state.before.as_ref().map_or(f64::MAX, |b| {
        motion(model.template.skeleton(), b, &state.pose)
    });
    state.still = if moved < settings.resting {
        state.still.saturating_add(1)
    } else {
        0
    };
    state.status == Status::Tracking
        && state.calibrated(&model.config)
        && state.bad_frames == 0
        && state.still >= settings.resting_frames
        && moved < model.config.fit.prediction.at_rest
}

/// Remembers a candidate that was refused, and what spoke against it.
fn refuse(
    model: &TrackerModel,
    state: &mut TrackerState,
    candidate: CandidateBox,
    reason: LostReason,
) {
    let settings = &model.config.segment.refusals;
    let log_odds = match reason {
        LostReason::Disagreement | LostReason::Thing => state.belief.log_odds,
        _ => state.refusals.log_odds(&candidate, settings),
    };
    state
        .refusals
        .record(candidate, log_odds.min(0.0), settings);
}

fn lose(state: &mut TrackerState, reason: LostReason) {
    state.pose_age = state.pose_age.saturating_add(1);
    state.before = None;
    if state.status != Status::Searching {
        state.status = Status::Lost { reason };
    }
    (state.bad_frames, state.disagreeing) = (0, 0);
    state.still_subject = None;
    state.belief.lose();
    (state.facing, state.is_unsure) = (None, false);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::TestScene;
    use tryon_geometry::camera::DepthImage;

    type Spoil = fn(&mut TrackerState);

    struct Session {
        scene: TestScene,
        state: TrackerState,
        workspace: Workspace,
    }

    impl Session {
        /// A subject at rest, tracked for a few frames.
        fn tracked() -> Self {
            let scene = TestScene::new(300, 480);
            let mut session = Self {
                state: TrackerState::new(&scene.model),
                workspace: Workspace::default(),
                scene,
            };
            let depth = session.scene.depth(&session.scene.pose);
            for _ in 0..4 {
                session.step(depth.clone()).expect("a step");
            }
            assert!(session.state.status.is_live());
            session
        }

        fn step(&mut self, depth: DepthImage) -> Result<StepReport, StepError> {
            let sequence = self.state.frames;
            let frame = RgbdFrame {
                sequence,
                time_ns: sequence * 33_333_333,
                depth,
                color: None,
            };
            step(
                &self.scene.model,
                &mut self.state,
                &frame,
                &mut self.workspace,
            )
        }

        fn empty(&self) -> DepthImage {
            let camera = &self.scene.model.calibration.depth;
            DepthImage::empty(camera.width, camera.height)
        }
    }

    #[test]
    fn a_subject_at_rest_is_found_where_it_stands() {
        let s = Session::tracked();
        let off = s.scene.distance(&s.state.pose, &s.scene.pose);
        assert!(off < 0.03, "{off} m");
    }

    #[test]
    fn an_empty_image_loses_the_subject_and_keeps_its_last_pose() {
        let mut s = Session::tracked();
        let (pose, shape) = (s.state.pose.clone(), s.state.shape.clone());
        for age in 1..4 {
            let report = s.step(s.empty()).expect("a step");
            let lost = Status::Lost {
                reason: LostReason::NoPerson,
            };
            assert_eq!((s.state.status, report.status), (lost, lost));
            assert_eq!((report.pose_age, report.person_cells), (age, 0));
        }
        assert_eq!((&s.state.pose, &s.state.shape), (&pose, &shape));

        let mut fresh = Session {
            state: TrackerState::new(&s.scene.model),
            ..s
        };
        let report = fresh.step(fresh.empty()).expect("a step");
        assert_eq!(report.status, Status::Searching, "nobody was there before");
    }

    #[test]
    fn unusable_inputs_are_refused_by_name_and_change_nothing() {
        let mut s = Session::tracked();
        let before = s.state.clone();
        let small = s.step(DepthImage::empty(8, 8));
        assert!(matches!(
            small,
            Err(StepError::ImageSize { got: (8, 8), .. })
        ));
        assert_eq!(s.state, before);

        let faults: [(&str, Spoil); 3] = [
            ("state.shape", |s| s.shape.bone_scales = vec![f64::NAN]),
            ("state.shape.displacements", |s| {
                s.shape.displacements = vec![f32::INFINITY];
            }),
            ("state.world_from_camera", |s| {
                let mut pose = *s.world_from_camera.iso();
                pose.translation.vector.y = f64::NAN;
                s.world_from_camera = tryon_geometry::math::Rigid::new(pose);
            }),
        ];
        for (name, spoil) in faults {
            s.state = before.clone();
            spoil(&mut s.state);
            let refused = s.step(s.empty());
            assert_eq!(refused, Err(StepError::NotFinite { field: name }));
            assert_eq!(s.state.frames, before.frames, "{name}");
        }
        s.state = before.clone();
        s.state.pose.angles.pop();
        let foreign = s.step(s.empty());
        assert!(matches!(foreign, Err(StepError::ForeignState { .. })));
    }
}
