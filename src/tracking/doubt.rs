//! Doubts about a fitted subject: a thing, turned around, in disagreement with its frame.

use super::state::TrackerState;
use super::status::{LostReason, Status};
use super::workspace::Workspace;
use crate::assess::{
    Agreement, FacingBelief, FacingVerdict, JointConfidence, PersonBelief, PersonEvidence, Verdict,
    confidence,
};
use crate::fit::{FitContext, FitReport, FitTerms, evaluate, fit_pose};
use crate::model::{PersonalBody, TrackerModel};
use crate::registration::Observation;
use crate::segment::CandidateBox;
use crate::settings::{AssessSettings, StepSettings};
use crate::start::{BodyProposals, person_cells, yaw_of_joints};
use nalgebra::Vector3;
use tryon_body::Pose;
use tryon_geometry::math::Camera;

/// A subject with its fitted pose.
pub(super) struct FittedSubject<'a> {
    pub model: &'a TrackerModel,
    pub observation: &'a Observation<'a>,
    pub candidate: Option<&'a CandidateBox>,
    /// Unit vector against gravity, camera frame.
    pub up: Vector3<f64>,
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
    /// the body parts of this frame in the scratch.
    pub(super) fn test(
        mut self,
        state: &mut TrackerState,
        workspace: &mut Workspace,
        is_classified: bool,
    ) -> Option<TurnedPose> {
        if !is_classified {
            let person = person_cells(self.observation, &self.up);
            let network = &self.model.part_network;
            network.infer(&person, &mut workspace.parts);
        }
        self.test_person(state, workspace);
        (state.belief.verdict != Verdict::Nobody)
            .then(|| self.test_facing(state, workspace))
            .flatten()
    }

    fn context<'c>(&'c self, body: &'c PersonalBody) -> FitContext<'c> {
        FitContext {
            model: self.model,
            body,
            observation: self.observation,
        }
    }

    fn test_person(&self, state: &mut TrackerState, workspace: &mut Workspace) {
        let scratch = &mut workspace.fit;
        scratch.draw(&self.context(&workspace.body), self.pose);
        let (image, map) = (&scratch.pairing.image, &workspace.parts.map);
        let matched = self.fit.matched as f32;
        let evidence = PersonEvidence::measure(self.model, self.observation, image, map, matched);
        let config = &self.model.config;
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

    fn test_facing(
        &mut self,
        state: &mut TrackerState,
        workspace: &mut Workspace,
    ) -> Option<TurnedPose> {
        let settings = &self.model.config.assess.facing;
        let joints = &workspace.fit.bones.joints;
        let yaw = yaw_of_joints(&self.model.part_classes, joints, &self.up.cast());
        let belief = state.facing.get_or_insert(FacingBelief::NEW);
        belief.update(yaw, &workspace.parts.yaw, settings);
        if belief.verdict(settings) != FacingVerdict::Reversed {
            return None;
        }
        let turned = self.turn_around(workspace);
        if turned.is_some() {
            belief.turn();
        } else {
            belief.doubt();
        }
        turned
    }

    /// Replaces pose and fit by those of a body that faces as the body parts do; `None` where no such body agrees with the
    /// frame.
    fn turn_around(&mut self, workspace: &mut Workspace) -> Option<TurnedPose> {
        let config = &self.model.config;
        let parts = &mut workspace.parts;
        let proposals = BodyProposals::new(self.model, self.observation, &self.up, parts);
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
