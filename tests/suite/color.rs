//! Tracking by colour and depth together; skipped without the model of `tools/landmarks`.

use std::f64::consts::TAU;
use tryon::body::embedded;
use tryon::formats::{RgbdFolder, RgbdSource, shared_data};
use tryon::geometry::camera::{Calibration, RgbdFrame};
use tryon::geometry::math::V3;
use tryon::landmarks::{Landmarker, shared_model};
use tryon::tracking::{
    BackgroundEye, COLOR_INTERVAL, ColorEye, PartClasses, TrackerConfig, TrackerModel,
    TrackerState, Workspace, step, yaw_of_joints,
};

/// Frames of a man who turns around once, with his camera.
fn turning_man() -> Option<(Vec<RgbdFrame>, Calibration)> {
    let folder = shared_data("rgbd/uva_turn")?;
    let mut source = RgbdFolder::open(&folder).expect("a recording");
    let calibration = source.calibration().clone();
    let frames = std::iter::from_fn(|| source.next_frame().transpose());
    Some((frames.map(|f| f.expect("a frame")).collect(), calibration))
}

/// Known yaw of the man in each frame, radians.
fn known_yaws() -> Vec<f64> {
    let file = shared_data("rgbd/uva_turn/poses.json").expect("beside the frames");
    let poses: serde_json::Value =
        serde_json::from_slice(&std::fs::read(file).expect("readable")).expect("JSON");
    let rotations = poses["R"].as_array().expect("rotations");
    let yaw = |rotation: &serde_json::Value| {
        // The front lies at −z of frame 0, whose rotation is the identity: the last row of each, turned over.
        let front = |k: usize| -rotation[2][k].as_f64().expect("a number");
        front(0).atan2(-front(2))
    };
    rotations.iter().map(yaw).collect()
}

#[test]
fn a_man_who_turns_around_is_followed_by_both_eyes() {
    let (Some(file), Some((frames, calibration))) = (shared_model(), turning_man()) else {
        return;
    };
    let landmarker = Landmarker::open(file).expect("the model");
    let mut eye = ColorEye::new(landmarker, calibration.clone());
    let model = TrackerModel::new(embedded::template(), calibration, TrackerConfig::default());
    let classes = PartClasses::new(model.template());
    let mut state = TrackerState::new(&model);
    let mut workspace = Workspace::default();
    let up = V3::new(0.0, -1.0, 0.0);
    let mut errors = Vec::new();
    let mut seen = 0;
    for (i, (frame, truth)) in frames.iter().zip(known_yaws()).enumerate() {
        if (i as u64).is_multiple_of(COLOR_INTERVAL)
            && let Some(sighting) = eye.look(frame).expect("it runs")
        {
            assert!(sighting.joints.len() >= 2, "frame {i}: {sighting:?}");
            seen += 1;
            state.see(sighting);
        }
        step(&model, &mut state, frame, &mut workspace).expect("a step");
        if !state.status.is_live() {
            continue;
        }
        let (_, bones) = workspace.posed(&model, &state);
        let yaw = yaw_of_joints(&classes, &bones.joints, &up).expect("an upright man");
        let off = (yaw - truth).rem_euclid(TAU);
        errors.push(off.min(TAU - off).to_degrees());
    }
    errors.sort_by(f64::total_cmp);
    let most = errors[errors.len() - 1];
    eprintln!(
        "{} live, {seen} sightings, yaw {:.0}° in the median, {most:.0}° at most",
        errors.len(),
        errors[errors.len() / 2]
    );
    assert!(
        errors.len() >= 48 && seen >= 12 && most < 35.0,
        "{errors:?}"
    );
}

#[test]
fn no_frame_waits_for_the_eye_beside_it() {
    let (Some(file), Some((frames, calibration))) = (shared_model(), turning_man()) else {
        return;
    };
    let landmarker = Landmarker::open(file).expect("the model");
    let mut eye = BackgroundEye::start(landmarker, calibration).expect("a thread");
    // The first look makes tables and searches: the next frames get nothing and go on.
    assert!(eye.exchange(&frames[0]).expect("no fault").is_none());
    assert!(eye.exchange(&frames[1]).expect("no fault").is_none());
    let sighting = (0..1_000_000_000u64).find_map(|_| {
        std::thread::yield_now();
        eye.exchange(&frames[2]).expect("no fault")
    });
    let sighting = sighting.expect("a man");
    assert_eq!(sighting.time_ns, frames[0].time_ns);
    assert!(sighting.trunk.shoulders.is_some());
    // Depth alone shows nothing, and asks for nothing.
    let depth = RgbdFrame {
        color: None,
        ..frames[3].clone()
    };
    assert!((0..8).all(|_| eye.exchange(&depth).is_ok()));
}
