//! One subject in view (Algorithm 1): find or predict → fit → recover → calibrate → filter → commit.

use super::doubt::{FittedSubject, TurnedPose, count_doubt, is_unsure};
use super::report::{Skipped, StepReport, Stopwatch, TrackingStagesMs};
use super::state::TrackerState;
use super::status::{LostReason, Status};
use super::subject_view::SubjectView;
use super::workspace::Workspace;
use crate::assess::{Agreement, JointConfidence, Seat, Verdict, confidence, sits};
use crate::fit::{
    FitContext, FitReport, FitTerms, FloorStance, FootMemory, HiddenKnees, PoseFilter, Prediction,
    assign_hands, fit_pose, floor_below, highest_hips, predict,
};
use crate::model::{PersonalBody, TrackerModel};
use crate::recover::{HiddenLimb, Repair};
use crate::registration::Observation;
use crate::registration::residual::FloorPlane;
use crate::segment::PersonSearch;
use crate::segment::part_network::PersonParts;
use crate::settings::Schedule;
use crate::shape::{SizeCalibration, SizeEstimate, first_shapes};
use crate::sighting::ColorSighting;
use crate::start::{BodyProposals, Outline, StartPrior, initial_pose, outline};
use nalgebra::Vector3;
use tryon_body::parts::BodyPart;
use tryon_body::{BodyShape, BoneTransforms, Pose};
use tryon_geometry::camera::RgbdFrame;
use tryon_geometry::math::{Camera, P3};
use tryon_geometry::spatial::OrganisedCloud;

/// Report in progress, with the stopwatch of its stages.
pub(super) struct StepLog {
    pub report: StepReport,
    watch: Stopwatch,
}

impl StepLog {
    /// Report after segmentation.
    pub(super) fn new(
        state: &TrackerState,
        grid: &OrganisedCloud,
        person: &PersonSearch,
        mut watch: Stopwatch,
    ) -> Self {
        let report = StepReport {
            status: state.status,
            iterations: 0,
            converged: false,
            visible_points: 0,
            person_cells: person.cells.len(),
            residual_mm: 0.0,
            explained: 0.0,
            matched: 0.0,
            quality: 0.0,
            agreement: Agreement::default(),
            confidence: Vec::new(),
            pose_age: 0,
            skipped: Skipped {
                cells: grid.depth.len() - person.cells.len(),
                ..Skipped::default()
            },
            stages_ms: TrackingStagesMs {
                segment: watch.lap(),
                ..TrackingStagesMs::default()
            },
        };
        Self { report, watch }
    }

    /// The report at the end of the step.
    pub(super) fn finish(mut self) -> StepReport {
        self.report.stages_ms.assess += self.watch.lap();
        self.report
    }

    fn add_turn(&mut self, turned: Option<TurnedPose>) {
        if let Some(turned) = turned {
            self.report.agreement = turned.agreement;
            self.report.confidence = turned.confidence;
        }
    }

    fn add_fit(&mut self, model: &TrackerModel, state: &TrackerState, fit: &FitReport) {
        let settings = &model.config.step;
        let report = &mut self.report;
        report.iterations = fit.iterations;
        report.converged = fit.converged;
        report.visible_points = fit.pairs.visible;
        report.residual_mm = fit.residual * 1e3;
        report.explained = fit.explained;
        report.matched = fit.matched;
        report.quality =
            fit.explained.min(fit.matched) / (1.0 + fit.residual / settings.poor_residual);
        report.skipped.hidden_points = fit.pairs.hidden;
        report.skipped.inconsistent_pairs = fit.pairs.inconsistent;
        report.skipped.searches = fit.pairs.reused;
        let most = model.config.fit.track.iterations;
        report.skipped.iterations = most.saturating_sub(fit.iterations);
        report.skipped.displacements = state.shape.displacements.len();
    }
}

/// A subject in view and the frame that shows it.
pub(super) struct SubjectFrame<'a> {
    pub model: &'a TrackerModel,
    pub frame: &'a RgbdFrame,
    pub person: &'a PersonSearch,
    pub observation: Observation<'a>,
    /// Unit vector against gravity, camera frame.
    pub up: Vector3<f64>,
    /// Of this subject in colour.
    pub sighting: Option<ColorSighting>,
}

impl SubjectFrame<'_> {
    fn view(&self) -> SubjectView<'_> {
        SubjectView {
            model: self.model,
            observation: &self.observation,
            up: self.up,
            sighting: self.sighting.as_ref(),
        }
    }

    fn context<'c>(&'c self, body: &'c PersonalBody) -> FitContext<'c> {
        FitContext {
            model: self.model,
            body,
            observation: &self.observation,
        }
    }

    /// Finds or follows the pose and adapts the size.
    pub(super) fn track(
        &self,
        state: &mut TrackerState,
        workspace: &mut Workspace,
        log: &mut StepLog,
    ) -> Result<(), LostReason> {
        let settings = &self.model.config.step;
        let config = &self.model.config;
        workspace.fit.pairing.forget();
        let found = !state.is_following();
        self.forget(state);
        let is_new = found && state.size.frames == 0;
        let before = size_before(state, found);
        let start = if found {
            self.find(state, workspace, log)?
        } else {
            self.predict(state, workspace)
        };
        let expected = (!found && config.calm > 0.0).then(|| state.pose.clone());
        let mut pose = start.pose;
        let schedule = Schedule {
            ahead: if start.is_fine { config.fit.anneal } else { 0 },
            ..config.fit.track
        };
        log.report.skipped.coarse_iterations = schedule.ahead;
        let first = if found { &config.fit.start } else { &schedule };
        let mut fit = self.fit(&mut pose, first, workspace);
        log.report.stages_ms.pose = log.watch.lap();
        let good = fit.explained >= settings.least_explained
            && fit.matched >= settings.least_matched
            && pose.is_finite();
        if good && self.is_size_due(state, &pose, workspace) {
            let adapted = self.calibrate(state, &mut pose, &schedule, workspace);
            fit = adapted.unwrap_or(fit);
            log.report.stages_ms.size = log.watch.lap();
        }
        log.add_fit(self.model, state, &fit);
        if !pose.is_finite() {
            return Err(LostReason::NotFinite);
        }
        if let Some(expected) = expected.filter(|_| good) {
            let filter = PoseFilter {
                model: self.model,
                rest: &workspace.body.rest,
                last: &expected,
                fitted: &pose,
                uncertainty: config.calm * fit.residual,
            };
            pose = filter.filter(&mut state.drift);
        }
        state.bad_frames = if good { 0 } else { state.bad_frames + 1 };
        if state.bad_frames > settings.patience {
            return Err(LostReason::Residual);
        }
        self.assess(&pose, workspace, log);
        let mut classified = found;
        if config.rescue {
            let is_detected = workspace.fit.terms.hands.map(|h| h.is_some());
            (state.repair).see_hands(is_detected, &config.recover.repair);
            self.hide_arms(&mut pose, state.repair.is_held(), workspace, log);
            log.report.stages_ms.assess = log.watch.lap();
            classified |= self.repair(state, workspace, &mut pose, &mut fit, log);
        }
        if classified || state.is_unsure || self.sighting.is_some() {
            let subject = self.fitted(&mut pose, &mut fit);
            log.add_turn(subject.test(state, workspace, classified));
        }
        log.report.stages_ms.repair += log.watch.lap();
        let agrees = log.report.agreement.wrong() <= settings.most_wrong;
        if state.belief.verdict == Verdict::Nobody || found && !agrees {
            if let Some(before) = before {
                (state.size, state.shape) = before;
            }
            return Err(refusal(state));
        }
        let status = state.status;
        state.subject += u64::from(is_new);
        self.commit(state, workspace, pose, &fit, &log.report.confidence);
        count_doubt(state, agrees, settings)?;
        state.is_unsure = is_unsure(state, &config.assess);
        if state.is_unsure {
            state.status = status;
        }
        let is_due = self.is_surface_due(good, state);
        workspace.surface_cells = is_due.then(|| self.person.cells.clone());
        Ok(())
    }

    /// Forgets a subject that was not seen for long.
    fn forget(&self, state: &mut TrackerState) {
        let is_absent = !state.is_following();
        if is_absent && state.pose_age > self.model.config.step.forget {
            state.reset(self.model);
        }
    }

    /// The subject with a fitted pose.
    fn fitted<'f>(
        &'f self,
        pose: &'f mut Pose<Camera>,
        fit: &'f mut FitReport,
    ) -> FittedSubject<'f> {
        FittedSubject {
            view: self.view(),
            candidate: self.person.candidate.as_ref(),
            time_ns: self.frame.time_ns,
            pose,
            fit,
        }
    }

    /// True at the start, and later while the body is seen as it hardly was before, without doubt.
    fn is_size_due(
        &self,
        state: &TrackerState,
        pose: &Pose<Camera>,
        workspace: &Workspace,
    ) -> bool {
        let config = &self.model.config;
        if !state.calibrated(config) {
            return true;
        }
        let is_sure = state.disagreeing == 0 && state.bad_frames == 0 && !state.is_unsure;
        let settings = &config.shape.size;
        let root = workspace.fit.centre();
        config.adapt_size && is_sure && state.size.is_view_open(pose, &root, settings)
    }

    /// Adapts size and shape to a fitted pose; the new fit where the pose was fitted again.
    fn calibrate(
        &self,
        state: &mut TrackerState,
        pose: &mut Pose<Camera>,
        schedule: &Schedule,
        workspace: &mut Workspace,
    ) -> Option<FitReport> {
        let mut calibration = SizeCalibration {
            model: self.model,
            observation: &self.observation,
            body: &mut workspace.body,
            scratch: &mut workspace.fit,
            up: self.up,
            cut_below: self.person.cut_below,
        };
        calibration.adapt(&mut state.size, &mut state.shape, pose, schedule)
    }

    /// Writes confidence and agreement of a fitted pose to the report.
    fn assess(&self, pose: &Pose<Camera>, workspace: &mut Workspace, log: &mut StepLog) {
        let context = self.context(&workspace.body);
        let (measure, fit) = (&mut workspace.agreement, &mut workspace.fit);
        let agreement = measure.measure(&context, pose, fit);
        log.report.confidence = confidence(&context, pose, fit, &agreement);
        log.report.agreement = agreement;
    }

    /// Puts arms in free space that no reading holds behind the readings while these are all covered, where that brings them
    /// out of it. An arm in a sleeve without return stays: that looks like free space, too.
    fn hide_arms(
        &self,
        pose: &mut Pose<Camera>,
        is_held: [bool; 2],
        workspace: &mut Workspace,
        log: &mut StepLog,
    ) {
        let settings = &self.model.config.recover.hidden;
        let parts = [BodyPart::LeftArm, BodyPart::RightArm];
        for (side, part) in parts.into_iter().enumerate() {
            let Some(limb) = &self.model.arms[side] else {
                continue;
            };
            let before = log.report.agreement;
            let in_air = before.parts[part as usize];
            let is_dark = is_held[side] || before.unknown[part as usize] > settings.most_unknown;
            let is_hidden =
                limb.is_hinge_unseen(&workspace.fit.unseen, settings.unseen) && !is_dark;
            if !is_hidden || before.uncovered > settings.most_uncovered || in_air < settings.in_air
            {
                continue;
            }
            let context = self.context(&workspace.body);
            let hidden = HiddenLimb { context, limb };
            let Some(moved) = hidden.behind_readings(pose, &mut workspace.fit.bones) else {
                continue;
            };
            self.assess(&moved, workspace, log);
            let after = &log.report.agreement;
            if after.uncovered <= settings.most_uncovered
                && after.parts[part as usize] < 0.5 * in_air
            {
                *pose = moved;
            } else {
                self.assess(pose, workspace, log);
            }
        }
    }

    /// Finds the subject anew: first size from the stature, then an initial pose.
    fn find(
        &self,
        state: &mut TrackerState,
        workspace: &mut Workspace,
        log: &mut StepLog,
    ) -> Result<Prediction, LostReason> {
        let settings = &self.model.config.step;
        workspace.fit.terms = FitTerms::start(&self.model.config.fit);
        let outline = self.outline(state);
        let is_unknown = state.size.frames == 0 && self.model.config.adapt_size;
        let stature = outline.and_then(|o| o.stature).filter(|_| is_unknown);
        let shapes = first_shapes(self.model, stature, &state.shape);
        let is_recent = state.status != Status::Searching && state.pose_age <= settings.recent;
        let recent = is_recent.then_some(state.pose.root.iso().rotation);
        let proposals = self.proposals(&mut workspace.parts);
        let prior = StartPrior {
            up: &self.up,
            recent,
            proposals: &proposals,
        };
        let starts = shapes.into_iter().filter_map(|shape| {
            workspace.body.update(self.model, &shape);
            let (context, scratch) = (self.context(&workspace.body), &mut workspace.fit);
            let (pose, fit) = initial_pose(&context, &outline?, &prior, scratch)?;
            (fit.explained >= settings.least_explained).then_some((fit.cost, pose, shape))
        });
        let best = starts.min_by(|a, b| a.0.total_cmp(&b.0));
        log.report.stages_ms.place = log.watch.lap();
        let (_, pose, shape) = best.ok_or(LostReason::Residual)?;
        workspace.body.update(self.model, &shape);
        state.shape = shape;
        (state.before, state.highest_hips, state.feet) = (None, None, None);
        state.seat = Seat::default();
        state.drift.clear();
        Ok(Prediction {
            pose,
            is_fine: false,
        })
    }

    /// Landmarks of the subject's silhouette.
    pub(super) fn outline(&self, state: &TrackerState) -> Option<Outline> {
        let camera_height = state.world_from_camera.iso().translation.vector.y;
        let floor = state.floor_known.then_some(camera_height);
        let (up, config) = (self.up.cast(), &self.model.config);
        outline(&self.observation, &up, self.person.cut_below, floor, config)
    }

    /// Proposals of both eyes for this frame.
    fn proposals(&self, parts: &mut PersonParts) -> BodyProposals {
        let view = self.view();
        view.see_parts(parts);
        view.proposals(parts)
    }

    /// Replaces pose and fit by better ones at proposed places where they disagree with the frame or, at times, with the
    /// proposals, and writes them to the report. True with proposals of this frame in the scratch.
    fn repair(
        &self,
        state: &mut TrackerState,
        workspace: &mut Workspace,
        pose: &mut Pose<Camera>,
        fit: &mut FitReport,
        log: &mut StepLog,
    ) -> bool {
        let settings = &self.model.config.recover.repair;
        let disagrees = state.repair.is_due(&log.report.agreement, settings);
        if !disagrees && !state.repair.is_check_due(settings) {
            return false;
        }
        let proposals = self.proposals(&mut workspace.parts);
        let is_detected = workspace.fit.terms.hands.map(|h| h.is_some());
        let is_contradicted = proposals.contradict(self.model, &workspace.fit.bones, is_detected);
        if !disagrees && !is_contradicted {
            return true;
        }
        let repair = Repair {
            context: self.context(&workspace.body),
            proposals: &proposals,
            pose,
            agreement: log.report.agreement,
            is_contradicted,
            is_stuck: state.repair.is_stuck(settings),
            is_held: state.repair.is_held(),
        };
        let repaired = repair.search(&mut workspace.fit, &mut workspace.agreement);
        let found = repaired.is_some();
        if let Some(better) = repaired {
            (*pose, *fit) = (better.pose, better.fit);
            log.add_fit(self.model, state, fit);
            log.report.agreement = better.agreement;
            let context = self.context(&workspace.body);
            log.report.confidence = confidence(&context, pose, &workspace.fit, &better.agreement);
        }
        state
            .repair
            .record(found, log.report.agreement.wrong(), settings);
        true
    }

    /// Sets the residuals of a tracked frame and predicts its pose.
    fn predict(&self, state: &TrackerState, workspace: &mut Workspace) -> Prediction {
        let config = &self.model.config;
        workspace.body.update(self.model, &state.shape);
        let standing = config.standing.then(|| {
            let camera_height = state.world_from_camera.iso().translation.vector.y;
            let height = if state.floor_known {
                -camera_height
            } else {
                floor_below(self.model, &workspace.body.rest, state.highest_hips?)?
            };
            Some(FloorStance {
                floor: FloorPlane {
                    up: self.up,
                    height,
                },
                feet: state.feet,
            })
        });
        workspace.fit.terms = FitTerms {
            standing: standing.flatten(),
            ..FitTerms::tracking(config)
        };
        let context = self.context(&workspace.body);
        let recent = state.recent_poses(config);
        predict(&context, &recent, self.frame.time_ns, &mut workspace.fit)
    }

    /// Fits the pose, with arms moved to their detected hands before and hidden knees bent after it.
    fn fit(
        &self,
        pose: &mut Pose<Camera>,
        schedule: &Schedule,
        workspace: &mut Workspace,
    ) -> FitReport {
        let (model, grid) = (self.model, self.observation.grid);
        let (rest, scratch) = (&workspace.body.rest, &mut workspace.fit);
        if !self.person.hands.is_empty() {
            scratch.terms.hands = assign_hands(model, rest, pose, grid, &self.person.hands);
        }
        let fit = fit_pose(&self.context(&workspace.body), pose, schedule, scratch);
        if let Some(standing) = scratch.terms.standing {
            let knees = HiddenKnees {
                model,
                rest,
                grid,
                floor: &standing.floor,
                joints: &scratch.bones.joints,
                unseen: &scratch.unseen,
            };
            knees.bend(pose);
        }
        fit
    }

    /// Writes pose, status and memory of a tracked frame into the state.
    fn commit(
        &self,
        state: &mut TrackerState,
        workspace: &Workspace,
        pose: Pose<Camera>,
        fit: &FitReport,
        confidence: &[JointConfidence],
    ) {
        let skeleton = self.model.template.skeleton();
        let found = !state.is_following();
        let before = std::mem::replace(&mut state.pose, pose);
        state.before = (!found).then_some(before);
        state.interval_ns = self.frame.time_ns.saturating_sub(state.time_ns);
        state.time_ns = self.frame.time_ns;
        state.pose_age = 0;
        state.centre = centre(self.observation.grid, &self.person.cells);
        state.quality = [fit.explained, fit.residual];
        let joints = &workspace.fit.bones.joints;
        let sits = sits(self.model, &self.up, joints, confidence);
        state.seat.update(sits, &self.model.config.assess.seat);
        state.status = state.live_status(&self.model.config);
        state.highest_hips = highest_hips(self.model, &self.up, state.highest_hips, joints);
        let mut bones = BoneTransforms::default();
        state.pose.bones(skeleton, &workspace.body.rest, &mut bones);
        let feet = FootMemory::of(self.model, &bones.joints);
        let standing = &self.model.config.fit.standing;
        state.feet = Some(state.feet.map_or(feet, |kept| kept.updated(feet, standing)));
    }

    /// Counts down to the next adaptation of the surface; true when it is due.
    fn is_surface_due(&self, good: bool, state: &mut TrackerState) -> bool {
        let config = &self.model.config;
        let [wait, interval] = &mut state.surface_due;
        *wait = wait.saturating_sub(1);
        *interval = (*interval).max(config.displacement_interval.max(1));
        let is_tracking = state.status == Status::Tracking;
        good && config.displacements && is_tracking && *wait == 0
    }
}

/// Reason for which a subject is let go.
fn refusal(state: &TrackerState) -> LostReason {
    match state.belief.verdict {
        Verdict::Nobody => LostReason::Thing,
        _ => LostReason::Disagreement,
    }
}

/// Size and shape after a refusal: those from before the search, if a person had them. None: as they are.
///
/// Another thing's size is no start for the next search.
fn size_before(state: &TrackerState, found: bool) -> Option<(SizeEstimate, BodyShape)> {
    match (found, state.belief.verdict) {
        (true, _) => Some((state.size.clone(), state.shape.clone())),
        (false, Verdict::Person) => None,
        (false, _) => Some(Default::default()),
    }
}

/// Mean of the readings of `cells`, camera frame, metres.
fn centre(grid: &OrganisedCloud, cells: &[u32]) -> P3 {
    let sum = cells.iter().fold(Vector3::zeros(), |s, &c| {
        s + grid.points[c as usize].coords.cast::<f64>()
    });
    P3::from((sum / cells.len().max(1) as f64).cast::<f32>())
}
