//! A subject with a body that was measured before, in this session before a loss or in an earlier one: tracking goes on with
//! it instead of measuring anew, and drops it when the person who is found is another.
//!
//! Evidence of another person: a height that differs from that of the fitted body, clothes of other colours, a residual that
//! stays far above the earlier one, or a fit that succeeds only with a new size.

use super::state::TrackerState;
use super::status::LostReason;
use super::subject::{StepLog, SubjectFrame};
use super::workspace::Workspace;
use crate::clothes_colors::ClothesColors;
use crate::model::TrackerModel;
use crate::shape::{KnownBody, Probation, SizeEstimate};

impl TrackerState {
    /// Goes on with a body that was measured before, as soon as somebody is found whom it fits; false for a state that has
    /// measured a body itself. The body must pass [`KnownBody::check`].
    pub fn know(&mut self, model: &TrackerModel, known: &KnownBody) -> bool {
        if self.size.frames > 0 {
            return false;
        }
        self.reset(model);
        self.subject = known.subject;
        self.shape = known.shape.clone();
        self.size = SizeEstimate::known(model.config.calibration_frames);
        self.probation = Some(Probation::begin(known.residual));
        true
    }

    /// Body of the subject once its size has settled.
    pub fn known_body(&self, model: &TrackerModel) -> Option<KnownBody> {
        (self.size.frames > 0 && self.is_sized(&model.config)).then(|| KnownBody {
            subject: self.subject,
            shape: self.shape.clone(),
            residual: self.probation.map_or(self.quality[1], |p| p.before),
        })
    }

    /// True with a body that was measured before and of which nobody was found yet.
    pub fn is_known_awaited(&self) -> bool {
        self.probation.is_some_and(|p| p.frames == 0)
    }
}

impl SubjectFrame<'_> {
    /// [`Self::track`], and again without the known body where that is of another person.
    pub(crate) fn track_known(
        &self,
        state: &mut TrackerState,
        workspace: &mut Workspace,
        log: &mut StepLog,
    ) -> Result<(), LostReason> {
        let is_awaited = state.probation.is_some();
        if !is_awaited && !state.is_following() {
            let own = state.known_body(self.model);
            state.probation = own.map(|k| Probation::begin(k.residual));
        }
        if state.probation.is_none() {
            let tracked = self.track(state, workspace, log);
            self.learn_clothes(state, workspace);
            return tracked;
        }
        let mut fresh = state.clone();
        fresh.reset(self.model);
        let tracked = self.track(state, workspace, log);
        let is_live = tracked.is_ok() && state.status.is_live();
        if tracked.is_ok() && !is_live {
            // In doubt: nothing is compared.
            return tracked;
        }
        // None: who was away for long is measured anew in any case.
        let compared = state.probation;
        let is_other = |probation| self.is_other(state, workspace, probation);
        if is_live && !compared.is_some_and(is_other) {
            return tracked;
        }
        if !is_live && !is_awaited {
            state.probation = None;
            return tracked;
        }
        let measured = self.track(&mut fresh, workspace, log);
        if is_live || measured.is_ok() {
            *state = fresh;
            return measured;
        }
        tracked
    }

    /// Remembers the colours of a live subject's clothes.
    fn learn_clothes(&self, state: &mut TrackerState, workspace: &Workspace) {
        let settings = &self.model.config.assess.clothes;
        let is_sure = state.status.is_live() && state.pose_age == 0 && state.disagreeing == 0;
        if !is_sure || !state.frames.is_multiple_of(settings.interval.max(1)) {
            return;
        }
        if let Some(seen) = self.clothes(workspace) {
            let kept = state.clothes.get_or_insert_default();
            kept.learn(&seen, settings);
        }
    }

    /// Colours of the subject under the body that was drawn last.
    fn clothes(&self, workspace: &Workspace) -> Option<ClothesColors> {
        let image = &workspace.fit.pairing.image;
        ClothesColors::of(self.model, self.frame, self.observation.grid, image)
    }

    /// Adds a live frame to the comparison; true for another person.
    fn is_other(
        &self,
        state: &mut TrackerState,
        workspace: &mut Workspace,
        mut probation: Probation,
    ) -> bool {
        if probation.frames == 0
            && (self.has_other_clothes(state, workspace) || self.has_other_height(state, workspace))
        {
            return true;
        }
        let is_other = probation.compare(state.quality[1], &self.model.config.shape);
        state.probation = is_other.is_none().then_some(probation);
        is_other.unwrap_or(false)
    }

    /// The clothes have other colours than before the loss. False where either was not seen in colour.
    fn has_other_clothes(&self, state: &TrackerState, workspace: &Workspace) -> bool {
        let settings = &self.model.config.assess.clothes;
        let both = state.clothes.as_ref().zip(self.clothes(workspace));
        let likeness = both.and_then(|(kept, seen)| kept.likeness(&seen, settings));
        likeness.is_some_and(|l| l < settings.least_likeness)
    }

    /// The fitted body ends elsewhere than the readings along the upright. False where these do not show a whole person.
    fn has_other_height(&self, state: &TrackerState, workspace: &mut Workspace) -> bool {
        let settings = &self.model.config.shape;
        let up = self.up.cast();
        let seen = self.outline(state);
        let seen = seen.filter(|_| !self.person.cut_below);
        let Some(seen) = seen.and_then(|o| o.stature) else {
            return false;
        };
        let crown = self.model.crown;
        let (vertices, bones) = workspace.posed(self.model, state);
        let lowest = vertices.iter().map(|v| up.dot(&v.coords));
        let lowest = lowest.fold(f32::INFINITY, f32::min);
        let height = self.up.dot(&bones.joints[crown].coords) - f64::from(lowest);
        (height - seen).abs() > settings.height_tolerance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::ShapeSettings;
    use crate::status::Status;
    use crate::step::follow;
    use crate::test_scene::TestScene;
    use tryon_body::BodyShape;
    use tryon_geometry::camera::RgbdFrame;

    /// A session before somebody at rest.
    struct Session {
        scene: TestScene,
        state: TrackerState,
        workspace: Workspace,
    }

    impl Session {
        /// Before a body of these coefficients.
        fn before(coefficients: &[f64]) -> Self {
            let mut scene = TestScene::new(300, 480);
            scene.model.config.calibration_frames = 4;
            scene.rest = scene.model.template.personalise(&BodyShape {
                coefficients: coefficients.to_vec(),
                ..BodyShape::default()
            });
            Self {
                state: TrackerState::new(&scene.model),
                workspace: Workspace::default(),
                scene,
            }
        }

        fn follow(&mut self, frames: u32) {
            let depth = self.scene.depth(&self.scene.pose);
            for _ in 0..frames {
                let frame = RgbdFrame {
                    sequence: self.state.frames,
                    time_ns: self.state.frames * 33_333_333,
                    depth: depth.clone(),
                    color: None,
                };
                let (state, workspace) = (&mut self.state, &mut self.workspace);
                follow(&self.scene.model, state, &frame, workspace).expect("a step");
            }
        }

        fn known(&self) -> KnownBody {
            self.state.known_body(&self.scene.model).expect("settled")
        }
    }

    /// The mean body as it was measured, with a number of its own.
    fn mean_body() -> KnownBody {
        let mut first = Session::before(&[]);
        assert_eq!(first.state.known_body(&first.scene.model), None);
        first.follow(6);
        let known = first.known();
        let template = &first.scene.model.template;
        assert_eq!((known.subject, known.check(template)), (1, Ok(())));
        KnownBody {
            subject: 7,
            ..known
        }
    }

    #[test]
    fn a_known_body_is_tracked_from_the_first_frame_and_not_measured_again() {
        let known = mean_body();
        let mut session = Session::before(&[]);
        assert!(session.state.know(&session.scene.model, &known));
        assert!(session.state.is_known_awaited());
        for _ in 0..2 * ShapeSettings::default().probation_frames {
            session.follow(1);
            assert_eq!(session.state.status, Status::Tracking);
            assert_eq!(
                (session.state.subject, &session.known().shape),
                (7, &known.shape)
            );
        }
        assert_eq!(session.state.probation, None, "it is the same person");
        assert!(
            !session.state.know(&session.scene.model, &known),
            "it has a body"
        );
    }

    #[test]
    fn a_person_of_another_shape_is_measured_from_nothing() {
        let known = mean_body();
        for other in [[1.2, 0.0], [-1.2, 0.0], [0.0, 1.5], [0.0, -1.5]] {
            let mut session = Session::before(&other);
            session.state.know(&session.scene.model, &known);
            session.follow(ShapeSettings::default().probation_frames + 6);
            assert_eq!(session.state.subject, 8, "{other:?}");
            let measured = session.known().shape.coefficients;
            for (a, b) in measured.iter().zip(other) {
                assert!((a - b).abs() < 0.7, "{measured:?} for {other:?}");
            }
        }
    }
}
