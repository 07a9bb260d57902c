//! Own motion: a subject without it isn't a person. Who stands still sways by more than a sensor's noise.

use super::block_readings::BlockReadings;
use crate::segment::CandidateBox;
use crate::settings::StepSettings;
use serde::{Deserialize, Serialize};
use tryon_geometry::camera::DepthImage;

/// Watch over a subject that has not moved yet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StillSubject {
    /// Readings within the subject in the first frame.
    readings: BlockReadings,
    /// Time of that frame.
    since_ns: u64,
}

/// Outcome of the watch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OwnMotion {
    /// It moved: a person, or carried by one.
    Moved,
    /// Not yet; nothing is said.
    Unknown,
    /// It never did for long enough: a thing.
    Never,
}

impl StillSubject {
    /// A subject found in this frame.
    pub(super) fn new(readings: BlockReadings, time_ns: u64) -> Self {
        Self {
            readings,
            since_ns: time_ns,
        }
    }

    /// Compares with a later frame.
    pub(super) fn watch(
        &mut self,
        image: &DepthImage,
        time_ns: u64,
        settings: &StepSettings,
    ) -> OwnMotion {
        if self.readings.has_changed(image, &settings.change) {
            return OwnMotion::Moved;
        }
        // One picture shown again and again says nothing, nor does a sensor whose noise hides the sway.
        let noise = self.readings.standard_error(image, &settings.change);
        if self.readings.is_repeated(image) || noise > settings.most_noise {
            self.since_ns = time_ns;
        }
        let seconds = time_ns.saturating_sub(self.since_ns) as f64 * 1e-9;
        if seconds >= settings.motionless {
            OwnMotion::Never
        } else {
            OwnMotion::Unknown
        }
    }
}

/// A candidate that never moved, until it does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StillThing {
    pub(super) candidate: CandidateBox,
    readings: BlockReadings,
}

impl StillThing {
    /// The thing that was taken for a subject.
    pub(super) fn new(candidate: CandidateBox, subject: StillSubject) -> Self {
        Self {
            candidate,
            readings: subject.readings,
        }
    }

    /// True while it stands as it stood.
    pub(super) fn is_still(&self, image: &DepthImage, settings: &StepSettings) -> bool {
        !self.readings.has_changed(image, &settings.change)
    }
}

#[cfg(test)]
mod tests {
    use crate::state::TrackerState;
    use crate::status::Status;
    use crate::step::step;
    use crate::test_scene::TestScene;
    use crate::workspace::Workspace;
    use nalgebra::Translation3;
    use rand::{Rng, SeedableRng};
    use tryon_geometry::camera::{DepthImage, RgbdFrame};
    use tryon_geometry::math::Rigid;

    /// Frames at 30 Hz from a start until a motionless subject is a thing.
    const LONG: u64 = 100;

    struct Session {
        scene: TestScene,
        state: TrackerState,
        workspace: Workspace,
        frames: u64,
        /// Largest noise, millimetres.
        noise: i16,
    }

    impl Session {
        fn new() -> Self {
            let scene = TestScene::new(300, 480);
            Self {
                state: TrackerState::new(&scene.model),
                workspace: Workspace::default(),
                scene,
                frames: 0,
                noise: 4,
            }
        }

        /// Depth of the subject `sway` metres nearer, with noise of a seed; none for `None`.
        fn depth(&self, sway: f64, noise: Option<u64>) -> DepthImage {
            let mut pose = self.scene.pose.clone();
            let moved = Translation3::new(0.0, 0.0, -sway) * pose.root.iso();
            pose.root = Rigid::new(moved);
            let mut image = self.scene.depth(&pose);
            if let Some(seed) = noise {
                let mut rng = rand_pcg::Pcg32::seed_from_u64(seed);
                let most = self.noise;
                for d in image.data_mut().iter_mut().filter(|d| **d > 0) {
                    *d = d.saturating_add_signed(rng.random_range(-most..=most));
                }
            }
            image
        }

        fn see(&mut self, depth: DepthImage) -> Status {
            let frame = RgbdFrame {
                sequence: self.frames,
                time_ns: self.frames * 33_333_333,
                depth,
                color: None,
            };
            self.frames += 1;
            let (model, state) = (&self.scene.model, &mut self.state);
            step(model, state, &frame, &mut self.workspace).expect("a step");
            self.state.status
        }

        /// Frames among `LONG` in which the subject is live, by the sway and noise of each frame.
        fn live(&mut self, of: impl Fn(u64) -> (f64, Option<u64>)) -> Vec<bool> {
            let frames = 0..LONG;
            let mut see = |i| {
                let (sway, noise) = of(i);
                let depth = self.depth(sway, noise);
                self.see(depth).is_live()
            };
            frames.map(&mut see).collect()
        }
    }

    #[test]
    fn what_never_moves_is_a_thing_until_it_moves() {
        let mut session = Session::new();
        let live = session.live(|i| (0.0, Some(i)));
        assert!(live[10..80].iter().all(|l| *l), "{live:?}");
        assert!(!live[99] && session.state.things.len() == 1);
        // It is not taken for a person again.
        assert!(session.live(|i| (0.0, Some(1000 + i))).iter().all(|l| !*l));
        // It walks.
        let live = session.live(|i| (0.004 * i as f64, Some(2000 + i)));
        assert!(live[60..].iter().all(|l| *l), "{live:?}");
        assert!(session.state.things.is_empty());
    }

    #[test]
    fn who_sways_and_who_is_shown_again_and_again_are_no_things() {
        let sway = |i: u64| 0.003 * (0.2 * i as f64).sin();
        let live = Session::new().live(|i| (sway(i), Some(i)));
        assert!(live[10..].iter().all(|l| *l), "{live:?}");
        let live = Session::new().live(|_| (0.0, None));
        assert!(live[10..].iter().all(|l| *l), "{live:?}");
    }

    #[test]
    fn noise_that_hides_a_sway_says_nothing() {
        let mut session = Session {
            noise: 20,
            ..Session::new()
        };
        let live = session.live(|i| (0.0, Some(i)));
        assert!(session.state.things.is_empty() && live[99], "{live:?}");
    }
}
