//! Bodies, scenes and frames that the tests of tracking share.

use std::path::PathBuf;
use std::sync::Arc;
use tryon::body::{BoneTransforms, Pose, RestBody, Template, skin};
use tryon::formats::shared_data;
use tryon::geometry::camera::{DepthImage, Intrinsics, NoiseModel, RgbdFrame};
use tryon::geometry::math::P3d;
use tryon::geometry::par::Par;
use tryon::geometry::raster::{View, VisibilityBuffer, rasterise};
use tryon::synth::{Actor, Routine, Sequence, Setting};
use tryon::tracking::{TrackerConfig, TrackerModel, TrackerState};
use tryon_bench::tracking::{TrackOutcome, follow};
use tryon_bench::{DepthScene, scenes};

const CHARLESTON: &str = "sequences/charleston_m_heavy_tof_room";

/// True for the long forms of the tests.
pub(crate) fn long() -> bool {
    std::env::var_os("TRYON_LONG_TESTS").is_some()
}

pub(crate) fn data() -> Option<PathBuf> {
    shared_data(".")
}

/// Template that the shared sequences are tracked with.
pub(crate) fn template() -> Option<Arc<Template>> {
    Some(scenes::subject(&data()?, "template").expect("template"))
}

/// The first frames of a recorded dance.
pub(crate) fn recorded(frames: usize) -> Option<DepthScene> {
    let mut scene = DepthScene::open(&shared_data(CHARLESTON)?).expect("scene");
    scene.frames.truncate(frames);
    scene.truth.truncate(frames);
    Some(scene)
}

/// Tracks a scene with default settings.
pub(crate) fn quiet(template: &Arc<Template>, scene: &DepthScene) -> TrackOutcome {
    let config = TrackerConfig::default();
    follow(template, &config, scene, |_, _, _, _, _| {})
}

/// A synthetic routine of the body that is tracked: the error is the tracker's own.
pub(crate) fn own_body(
    routine: Routine,
    noise: NoiseModel,
    frames: u64,
) -> (Arc<Template>, DepthScene) {
    let subject = Actor::default();
    let template = subject.template.clone();
    let setting = Setting {
        routine,
        noise,
        color: false,
        ..Setting::default()
    };
    let sequence = Sequence::new(subject, setting);
    (template, DepthScene::synthetic("own", &sequence, frames))
}

pub(crate) fn fixed_size() -> TrackerConfig {
    TrackerConfig {
        adapt_size: false,
        displacements: false,
        ..TrackerConfig::default()
    }
}

/// Frame `i` of a stream at 30 frames per second.
pub(crate) fn frame(i: u64, depth: DepthImage) -> RgbdFrame {
    RgbdFrame {
        sequence: i,
        time_ns: i * 33_333_333,
        depth,
        color: None,
    }
}

/// Joints of the tracked body, camera frame, metres.
pub(crate) fn joints(model: &TrackerModel, state: &TrackerState) -> Vec<P3d> {
    let rest = model.template().personalise(&state.shape);
    bones(model.template(), &rest, &state.pose).joints
}

pub(crate) fn bones(template: &Template, rest: &RestBody, pose: &Pose) -> BoneTransforms {
    let mut bones = BoneTransforms::default();
    pose.bones(template.skeleton(), rest, &mut bones);
    bones
}

/// Depth image of a posed template without background.
pub(crate) fn picture(template: &Template, camera: Intrinsics, pose: &Pose) -> DepthImage {
    let rest = template.personalise(&Default::default());
    let (weights, bones) = (template.weights(), bones(template, &rest, pose));
    let mut vertices = Vec::new();
    skin(Par::Seq, &rest.vertices, weights, &bones, &mut vertices);
    let view = View::Perspective { camera, near: 0.2 };
    let mut buffer = VisibilityBuffer::default();
    rasterise(&view, &vertices, template.mesh().faces(), &mut buffer);
    NoiseModel::None.apply(&camera, &buffer.depth, 0, 0)
}
