//! Doubts about a fitted subject: a thing, turned around, in disagreement with its frame.

use super::state::TrackerState;
use super::status::{LostReason, Status};
use super::subject_view::SubjectView;
use super::workspace::Workspace;
use crate::assess::{
    Agreement, FacingBelief, FacingVerdict, JointConfidence, PersonBelief, PersonEvidence, Verdict,
    confidence,
};
use crate::fit::{FitContext, FitReport, FitTerms, evaluate, fit_pose};
use crate::model::PersonalBody;
use crate::segment::CandidateBox;
use crate::segment::part_network::YawBelief;
use crate::settings::{AssessSettings, StepSettings};
use crate::start::yaw_of_joints;
use nalgebra::Vector3;
use tryon_body::Pose;
use tryon_geometry::math::Camera;

/// A subject with its fitted pose.
pub(super) struct FittedSubject<'a> {
    pub view: SubjectView<'a>,
    pub candidate: Option<&'a CandidateBox>,
    pub time_ns: u64,
    pub pose: &'a mut Pose<Camera>,
    pub fit: &'a mut FitReport,
}

/// Assessment of a pose that was turned around.
pub(super) struct TurnedPose {
    pub agreement: Agreement,
    pub confidence: Vec<JointConfidence>,
}

impl FittedSubject<'_> {
    /// Tests whether the subject is a person and faces as its pose does; turns a reversed pose around. `is_classified` with
    /// the body parts of this frame in the scratch; else a sighting in colour tests the facing alone.
    pub(super) fn test(
        mut self,
        state: &mut TrackerState,
        workspace: &mut Workspace,
        is_classified: bool,
    ) -> Option<TurnedPose> {
        let is_due = is_classified || state.is_unsure;
        if is_due {
            if !is_classified {
                self.view.see_parts(&mut workspace.parts);
            }
            self.test_person(state, workspace);
            if state.belief.verdict == Verdict::Nobody {
                return None;
            }
        }
        let seen = is_due.then_some(workspace.parts.yaw);
        let votes = seen.or_else(|| self.view.yaw_in_color())?;
        let is_reversed = self.is_reversed(state, workspace, &votes);
        if !is_reversed {
            return None;
        }
        if !is_due {
            self.view.see_parts(&mut workspace.parts);
        }
        self.turn_around(state, workspace)
    }

    fn context<'c>(&'c self, body: &'c PersonalBody) -> FitContext<'c> {
        FitContext {
            model: self.view.model,
            body,
            observation: self.view.observation,
        }
    }

    fn test_person(&self, state: &mut TrackerState, workspace: &mut Workspace) {
        let scratch = &mut workspace.fit;
        scratch.draw(&self.context(&workspace.body), self.pose);
        let (image, map) = (&scratch.pairing.image, &workspace.parts.map);
        let matched = self.fit.matched as f32;
        let evidence =
            PersonEvidence::measure(self.view.model, self.view.observation, image, map, matched);
        let config = &self.view.model.config;
        let settings = &config.assess.belief;
        if !state.is_following() {
            let refusals = &config.segment.refusals;
            let refused = |c| state.refusals.log_odds(c, refusals);
            let refused = self.candidate.map_or(0.0, refused);
            state.belief = PersonBelief::start(refused, settings);
            state.facing = None;
        }
        state.belief.update(evidence, settings);
    }

    /// Adds the belief in the yaw to that in the pose's facing; true for a pose that is turned around.
    fn is_reversed(
        &self,
        state: &mut TrackerState,
        workspace: &mut Workspace,
        votes: &YawBelief,
    ) -> bool {
        let model = self.view.model;
        let settings = &model.config.assess.facing;
        let joints = &workspace.fit.bones.joints;
        let yaw = yaw_of_joints(&model.part_classes, joints, &self.view.up.cast());
        let forward = self.forward_speed(state, workspace);
        let belief = state.facing.get_or_insert(FacingBelief::NEW);
        belief.update(yaw, forward, votes, settings);
        belief.verdict(settings) == FacingVerdict::Reversed
    }

    /// Speed of the pelvis along the level front since the last pose, m/s; 0 for a body just found.
    fn forward_speed(&self, state: &TrackerState, workspace: &Workspace) -> f32 {
        let passed = self.time_ns.saturating_sub(state.time_ns);
        if !state.is_following() || state.pose_age > 0 || passed == 0 {
            return 0.0;
        }
        let pelvis = workspace.body.rest.joints[0];
        let [now, before] = [&*self.pose, &state.pose].map(|pose| pose.root.iso() * pelvis);
        let up = self.view.up;
        let front = self.pose.root.iso().rotation * Vector3::z();
        let level = front - up * up.dot(&front);
        let along = level.try_normalize(f64::EPSILON);
        let moved = along.map_or(0.0, |front| front.dot(&(now - before)));
        (moved * 1e9 / passed as f64) as f32
    }

    /// Replaces pose and fit by those of a body that faces as the body parts do; in doubt where no such body agrees with the
    /// frame.
    fn turn_around(
        &mut self,
        state: &mut TrackerState,
        workspace: &mut Workspace,
    ) -> Option<TurnedPose> {
        let turned = self.turned(workspace);
        let belief = state.facing.get_or_insert(FacingBelief::NEW);
        if turned.is_some() {
            belief.turn();
        } else {
            belief.doubt();
        }
        turned
    }

    fn turned(&mut self, workspace: &mut Workspace) -> Option<TurnedPose> {
        let config = &self.view.model.config;
        let proposals = self.view.proposals(&workspace.parts);
        let (context, scratch) = (self.context(&workspace.body), &mut workspace.fit);
        let reach = config.start.reach[1];
        let cost = evaluate(&context, self.pose, reach, scratch).cost;
        let limit = config.assess.facing.dearer * cost;
        let terms = FitTerms::hypothesis(&config.fit);
        let mut poses = scratch.with_terms(terms, |s| proposals.poses(&context, s));
        poses.retain(|pose| !proposals.faces_away(pose));
        let fitted = poses.into_iter().map(|mut pose| {
            let fit = fit_pose(&context, &mut pose, &config.fit.start, scratch);
            let cost = evaluate(&context, &pose, reach, scratch).cost;
            (cost, pose, fit)
        });
        let best = fitted.min_by(|a, b| a.0.total_cmp(&b.0));
        let (_, pose, fit) = best.filter(|b| b.0 <= limit && b.1.is_finite())?;
        let agreement = workspace.agreement.measure(&context, &pose, scratch);
        if agreement.wrong() > config.step.most_wrong {
            return None;
        }
        let confidence = confidence(&context, &pose, scratch, &agreement);
        (*self.pose, *self.fit) = (pose, fit);
        Some(TurnedPose {
            agreement,
            confidence,
        })
    }
}

/// True for a subject that is followed but not live: maybe a thing, maybe turned around.
pub(super) fn is_unsure(state: &TrackerState, settings: &AssessSettings) -> bool {
    let facing = state.facing.map(|f| f.verdict(&settings.facing));
    state.belief.verdict == Verdict::Unsure || facing == Some(FacingVerdict::Undecided)
}

/// Counts frames in doubt: their pose is followed, but not live.
pub(super) fn count_doubt(
    state: &mut TrackerState,
    agrees: bool,
    settings: &StepSettings,
) -> Result<(), LostReason> {
    let reason = LostReason::Disagreement;
    state.disagreeing = if agrees { 0 } else { state.disagreeing + 1 };
    if state.disagreeing > settings.doubt {
        return Err(reason);
    }
    if !agrees {
        state.status = Status::Lost { reason };
    }
    Ok(())
}
