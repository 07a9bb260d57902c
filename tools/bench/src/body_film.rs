//! A person in motion as a body a picture: tracked in a recording, or played.

use super::EvaluateError;
use std::path::Path;
use std::sync::Arc;
use tryon_body::{Pose, RestBody, Template, embedded};
use tryon_formats::open_recording;
use tryon_geometry::math::{P3, World};
use tryon_synth::Sequence;
use tryon_tracking::{Status, TrackerConfig, TrackerModel, TrackerState, Workspace, step};

/// Showings of a picture that is alone in its recording.
const STILL: u64 = 45;
/// Time between two of them (ns).
const FRAME_NS: u64 = 33_333_333;

/// A person and the body in each picture.
pub struct BodyFilm {
    /// Template of the body.
    pub template: Arc<Template>,
    /// Its rest shape.
    pub rest: RestBody,
    /// Pose of the first body.
    pub start: Pose<World>,
    /// Skin of each picture, world (m).
    pub bodies: Vec<Vec<P3>>,
}

impl BodyFilm {
    /// The person in a recording, from the first picture in which they are tracked.
    ///
    /// # Errors
    /// A recording that cannot be read, or shows nobody.
    pub fn tracked(recording: &Path) -> Result<Self, EvaluateError> {
        let fault = |why: &dyn ToString| EvaluateError::new(recording.display(), why.to_string());
        let mut source = open_recording(recording).map_err(|e| fault(&e))?;
        let template = embedded::template();
        let calibration = source.calibration().clone();
        let model = TrackerModel::new(template.clone(), calibration, TrackerConfig::default());
        let (mut state, mut work) = (TrackerState::new(&model), Workspace::default());
        let (mut bodies, mut begun) = (Vec::new(), None);
        let times = if source.len() == Some(1) { STILL } else { 1 };
        while let Some(mut frame) = source.next_frame().map_err(|e| fault(&e))? {
            for _ in 0..times {
                step(&model, &mut state, &frame, &mut work).map_err(|e| fault(&e))?;
                frame.time_ns += FRAME_NS;
                if state.status != Status::Tracking {
                    continue;
                }
                let (to_world, mut body) = (state.world_from_camera, Vec::new());
                to_world.points_f32(work.posed(&model, &state).0, &mut body);
                bodies.push(body);
                begun.get_or_insert_with(|| {
                    let start = state.pose.transformed(&to_world);
                    (template.personalise(&state.shape), start)
                });
            }
        }
        let (rest, start) = begun.ok_or_else(|| fault(&"nobody is tracked"))?;
        Ok(Self {
            template,
            rest,
            start,
            bodies,
        })
    }

    /// The first pictures of a synthetic sequence with somebody in it.
    pub fn played(sequence: &Sequence, pictures: u64) -> Self {
        let to_world = sequence.setting().world_from_camera;
        let body = |i| {
            let mut body = Vec::new();
            to_world.points_f32(&sequence.truth(i).vertices, &mut body);
            body
        };
        Self {
            template: sequence.actor().template.clone(),
            rest: sequence.rest().clone(),
            start: sequence.truth(0).pose.transformed(&to_world),
            bodies: (0..pictures).map(body).collect(),
        }
    }
}
