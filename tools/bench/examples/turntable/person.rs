//! Bodies of the turntable: named shapes, files, and people tracked in recordings.

use std::sync::Arc;
use tryon::body::{BodyShape, BoneTransforms, Pose, RestBody, Template, skin};
use tryon::geometry::math::{Body, P3, Rigid, World};
use tryon::tracking::{self, TrackerConfig, TrackerModel, TrackerState};

/// Stature, girth, sex, limb length, torso length, shoulders, chest, waist, hip in standard deviations.
fn shape(name: &str) -> Option<Vec<f64>> {
    Some(match name {
        "average" => vec![],
        "slim_woman" => vec![-0.4, -1.0, -1.2, 0.2, 0.0, -0.2, 0.0, -0.3, 0.1],
        "curvy_woman" => vec![-0.6, 1.0, -1.3, -0.2, 0.0, 0.0, 0.8, 0.2, 1.0],
        "heavy_man" => vec![0.3, 2.0, 1.2, -0.2, 0.2, 0.3, 0.0, 0.6, 0.0],
        "tall_man" => vec![1.8, -0.4, 1.0, 0.5, 0.0, 0.3, 0.0, 0.0, 0.0],
        _ => return None,
    })
}

/// A body and its motion.
pub(crate) struct Person {
    pub(crate) template: Arc<Template>,
    pub(crate) rest: RestBody,
    /// Of a recording: the pose in which garments are put on, and the body in each picture after it.
    pub(crate) film: Option<(Pose<World>, Vec<Vec<P3>>)>,
}

/// Loads a named shape, a body file or a recording.
pub(crate) fn load(name: &str) -> Person {
    let path = std::path::Path::new(name);
    if let Some(coefficients) = shape(name) {
        let template = tryon::body::embedded::template();
        let rest = template.personalise(&BodyShape {
            coefficients,
            ..BodyShape::default()
        });
        return Person {
            template,
            rest,
            film: None,
        };
    }
    if path.is_dir() || name.ends_with(".mcap") {
        return tracked(path);
    }
    let arrays = tryon::formats::npz::read_smpl(path).expect("a body");
    let template =
        Arc::new(tryon::body::import::template_from_smpl("file", &arrays).expect("a body"));
    let rest = template.personalise(&BodyShape::default());
    Person {
        template,
        rest,
        film: None,
    }
}

/// The person in a recording, from the first picture in which they are tracked.
fn tracked(path: &std::path::Path) -> Person {
    const STILL: u64 = 45;
    let mut source = tryon::formats::open_recording(path).expect("a recording");
    let template = tryon::body::embedded::template();
    let model = TrackerModel::new(
        template.clone(),
        source.calibration().clone(),
        TrackerConfig::default(),
    );
    let (mut state, mut work) = (TrackerState::new(&model), tracking::Workspace::default());
    let (mut film, mut begun) = (Vec::new(), None);
    let mut see = |frame: &tryon::geometry::camera::RgbdFrame| {
        tracking::step(&model, &mut state, frame, &mut work).expect("a step");
        if state.status != tracking::Status::Tracking {
            return;
        }
        let mut body = Vec::new();
        state
            .world_from_camera
            .points_f32(work.posed(&model, &state).0, &mut body);
        film.push(body);
        begun.get_or_insert_with(|| {
            let pose = Pose {
                root: state.world_from_camera * state.pose.root,
                angles: state.pose.angles.clone(),
            };
            (template.personalise(&state.shape), pose)
        });
    };
    let still = source.len() == Some(1);
    while let Some(mut frame) = source.next_frame().expect("a picture") {
        for _ in 0..if still { STILL } else { 1 } {
            see(&frame);
            frame.time_ns += 33_333_333;
        }
    }
    let (rest, pose) = begun.expect("nobody is tracked");
    Person {
        template,
        rest,
        film: Some((pose, film)),
    }
}

/// Named poses; `t` in seconds moves those that move.
pub(crate) fn pose(name: &str, template: &Template, rest: &RestBody, t: f64) -> Pose<World> {
    let sk = template.skeleton();
    let mut p = Pose::rest(sk, Rigid::<World, Body>::identity());
    let swing = 0.5 * (t * 6.0).sin();
    let down = match name {
        "tpose" => 0.0,
        "raise" => 1.3 - 2.2 * (0.5 - 0.5 * (t * 2.0).cos()),
        _ => 1.3,
    };
    if name != "rest" {
        p.lower_arms(template.skeleton(), rest, down);
    }
    if name == "walk" {
        for (side, a) in [("left", swing), ("right", -swing)] {
            p.set(sk, &format!("{side}_hip"), &[-a - 0.1, 0.0, 0.0]);
            p.set(
                sk,
                &format!("{side}_knee"),
                &[0.3 - 0.3 * a.signum() * a.abs(), 0.0, 0.0],
            );
        }
    }
    p
}

/// Skins the body in `pose`; world, metres.
pub(crate) fn posed(template: &Template, rest: &RestBody, pose: &Pose<World>) -> Vec<P3> {
    let mut bones = BoneTransforms::default();
    pose.bones(template.skeleton(), rest, &mut bones);
    let mut out = Vec::new();
    skin(
        tryon::geometry::par::Par::Seq,
        &rest.vertices,
        template.weights(),
        &bones,
        &mut out,
    );
    out
}
