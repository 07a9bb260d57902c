//! Standard scenes: other bodies, other motions and other noise than the shared sequences have.

use super::{DepthScene, EvaluateError};
use std::path::Path;
use std::sync::Arc;
use tryon_body::Template;
use tryon_body::import::template_from_smpl;
use tryon_formats::npz::read_smpl;
use tryon_formats::read_motion;
use tryon_geometry::camera::NoiseModel;
use tryon_geometry::math::P3d;
use tryon_synth::{Actor, Room, Routine, Sequence, Setting};

/// The paper's two failures (section 6.4) on a body that its template does not have: a torso seen from the waist up that
/// turns by ±40°, and an arm that gives no return, alone in the dark and before a wall.
///
/// # Errors
/// When the body cannot be read.
pub fn hard(data: &Path) -> Result<Vec<DepthScene>, EvaluateError> {
    let subject = Actor {
        template: subject(data, "subject_f_avg")?,
        ..Actor::default()
    };
    let setting = |height: f64, away: f64, routine| Setting {
        world_from_camera: Setting::tilted(height, 0.0, 0.0),
        home: P3d::new(0.0, 0.0, -away),
        room: None,
        noise: NoiseModel::KinectV1,
        routine,
        color: false,
        seed: 11,
        ..Setting::default()
    };
    let frames = 200;
    let upper = Sequence::new(subject.clone(), setting(1.35, 1.25, Routine::Turn));
    let turn = DepthScene::synthetic("turn_upper", &upper, frames);
    let whole = Sequence::new(subject.clone(), setting(1.0, 2.4, Routine::TryOn));
    let arm = DepthScene::synthetic("arm_without_return", &whole, frames);
    let arm = arm
        .without_return("left_shoulder", "left_elbow", 0.10)
        .without_return("left_elbow", "left_wrist", 0.09);
    // The same before a wall: there the arm leaves a hole.
    let walled = Setting {
        room: Some(Room::default()),
        ..setting(1.0, 2.4, Routine::TryOn)
    };
    let hole = DepthScene::synthetic(
        "arm_without_return_room",
        &Sequence::new(subject, walled),
        frames,
    );
    let hole = hole
        .without_return("left_shoulder", "left_elbow", 0.10)
        .without_return("left_elbow", "left_wrist", 0.09);
    Ok(vec![turn, arm, hole])
}

/// Scenes that should cost next to nothing: a subject at rest, and an empty room.
///
/// # Errors
/// When the body cannot be read.
pub fn idle(data: &Path) -> Result<Vec<DepthScene>, EvaluateError> {
    let subject = Actor {
        template: subject(data, "subject_m_heavy")?,
        ..Actor::default()
    };
    let scene = |name: &str, routine| {
        let setting = Setting {
            routine,
            color: false,
            seed: 5,
            ..Setting::default()
        };
        DepthScene::synthetic(name, &Sequence::new(subject.clone(), setting), 150)
    };
    Ok(vec![
        scene("still", Routine::Still),
        scene("empty", Routine::Empty),
    ])
}

/// Name, body of `body/makehuman_smpl_layout`, motion clip of `motion` (the try-on routine without one), noise, room,
/// camera height (metres) and tilt (degrees), distance (metres), frames.
type Spec = (
    &'static str,
    &'static str,
    Option<&'static str>,
    NoiseModel,
    bool,
    [f64; 3],
    u64,
);

const UNSEEN: [Spec; 6] = [
    (
        "tryon_f_short_heavy_kinect1_room",
        "subject_f_short_heavy",
        None,
        NoiseModel::KinectV1,
        true,
        [1.0, 3.0, 2.4],
        210,
    ),
    (
        "tryon_m_heavy_tof_noroom",
        "subject_m_heavy",
        None,
        NoiseModel::TimeOfFlight,
        false,
        [1.2, 5.0, 2.6],
        210,
    ),
    (
        "clip_m_tall_kinect1_noroom",
        "subject_m_tall",
        Some("cmu_asf_amc/13_31.amc"),
        NoiseModel::KinectV1,
        false,
        [1.0, 0.0, 2.8],
        180,
    ),
    (
        "clip_f_avg_tof_room",
        "subject_f_avg",
        Some("cmu_asf_amc/13_29.amc"),
        NoiseModel::TimeOfFlight,
        true,
        [1.1, 3.0, 2.8],
        180,
    ),
    (
        "sword_f_short_heavy_tof_room",
        "subject_f_short_heavy",
        Some("cmu_asf_amc/02_07.amc"),
        NoiseModel::TimeOfFlight,
        true,
        [1.0, 3.0, 2.6],
        180,
    ),
    (
        "upper_m_tall_kinect1_noroom",
        "subject_m_tall",
        None,
        NoiseModel::KinectV1,
        false,
        [1.45, 0.0, 1.25],
        210,
    ),
];

/// Names for [`unseen`].
pub fn unseen_names() -> impl Iterator<Item = &'static str> {
    UNSEEN.iter().map(|s| s.0)
}

/// Reads a body in SMPL layout.
///
/// # Errors
/// Names the file's array, joint or vertex at fault.
pub fn subject(data: &Path, name: &str) -> Result<Arc<Template>, EvaluateError> {
    let fault = |why: String| EvaluateError::Scene {
        scene: name.to_owned(),
        why,
    };
    let path = data
        .join("body/makehuman_smpl_layout")
        .join(format!("{name}.npz"));
    let arrays = read_smpl(&path).map_err(|e| fault(e.to_string()))?;
    Ok(Arc::new(
        template_from_smpl(name, &arrays).map_err(|e| fault(e.to_string()))?,
    ))
}

/// A scene that nothing was tuned on: `data` is the folder with the shared bodies and motions.
///
/// # Errors
/// When there is no scene of that name, or its body or motion cannot be read.
pub fn unseen(data: &Path, name: &str) -> Result<DepthScene, EvaluateError> {
    let fault = |why: String| EvaluateError::Scene {
        scene: name.to_owned(),
        why,
    };
    let Some(&(_, body, clip, noise, room, [height, down, away], frames)) =
        UNSEEN.iter().find(|s| s.0 == name)
    else {
        return Err(fault("no such scene".into()));
    };
    let subject = Actor {
        template: subject(data, body)?,
        ..Actor::default()
    };
    let setting = Setting {
        world_from_camera: Setting::tilted(height, down, 0.0),
        home: P3d::new(0.0, 0.0, -away),
        room: room.then(Room::default),
        noise,
        routine: Routine::TryOn,
        color: false,
        seed: 7,
        ..Setting::default()
    };
    let mut sequence = Sequence::new(subject, setting);
    if let Some(clip) = clip {
        let motion =
            read_motion(&data.join("motion").join(clip)).map_err(|e| fault(e.to_string()))?;
        sequence = sequence
            .with_clip(motion.at_cmu_rate())
            .map_err(|e| fault(e.to_string()))?;
    }
    Ok(DepthScene::synthetic(name, &sequence, frames))
}
