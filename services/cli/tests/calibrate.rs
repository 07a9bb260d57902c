//! `tryon camera calibrate` from outside: a recording of somebody who walks, and of somebody who doesn't.
#![allow(clippy::unwrap_used, missing_docs)]

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use tryon::formats::{CameraFile, RgbdFolderWriter};
use tryon::geometry::camera::{Calibration, Intrinsics};
use tryon::geometry::math::{Rigid, V3d};
use tryon::synth::{Actor, Routine, SeparateColor, Sequence, Setting};

/// Bars of the product: translation (m), rotation (rad), time (s).
const BARS: (f64, f64, f64) = (0.010, 0.5 * std::f64::consts::PI / 180.0, 0.008);

fn calibrate(recording: &Path, out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tryon"))
        .args(["camera", "calibrate"])
        .arg(recording)
        .arg("--out")
        .arg(out)
        .output()
        .expect("starts")
}

/// Colour beside depth, 41 ms late.
fn color_camera() -> SeparateColor {
    SeparateColor {
        camera: Intrinsics::KINECT_V1.resized(320, 240),
        color_from_depth: Rigid::from_parts(V3d::new(0.05, -0.01, 0.0), Default::default()),
        delay: 0.041,
    }
}

/// A folder of small frames; its calibration has both cameras in one place.
fn record(folder: &Path, routine: Routine, frames: u64) {
    let setting = Setting {
        camera: Intrinsics::KINECT_V1.resized(320, 240),
        color_camera: Some(color_camera()),
        routine,
        ..Setting::default()
    };
    let sequence = Sequence::new(Actor::default(), setting);
    let stated = Calibration {
        color_from_depth: Rigid::identity(),
        ..sequence.calibration().clone()
    };
    let mut writer = RgbdFolderWriter::create(folder, &stated).unwrap();
    (0..frames).for_each(|i| writer.write(&sequence.frame(i).0).unwrap());
}

#[test]
fn a_walk_is_calibrated_and_the_file_reads_back() {
    let dir = tempfile::tempdir().unwrap();
    let (folder, json) = (dir.path().join("walk"), dir.path().join("camera.json"));
    record(&folder, Routine::Walk, 270);
    let out = calibrate(&folder, &json);
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    assert!(
        said.contains("translation:") && said.contains("270 frames compared"),
        "{said}"
    );

    let file = CameraFile::read(&json).unwrap();
    let truth = color_camera();
    let off = file.lenses.color_from_depth.inverse() * truth.color_from_depth;
    assert!(off.iso().translation.vector.norm() < BARS.0, "{said}");
    assert!(off.iso().rotation.angle() < BARS.1, "{said}");
    assert!(
        (file.color_time_offset_s - truth.delay).abs() < BARS.2,
        "{said}"
    );

    // The next estimate starts at the last one: nothing is left to find.
    std::fs::copy(&json, folder.join("camera.json")).unwrap();
    let again = dir.path().join("again.json");
    assert!(calibrate(&folder, &again).status.success());
    let text: Value = serde_json::from_slice(&std::fs::read(&again).unwrap()).unwrap();
    let offset = text["color_time_offset_s"].as_f64().unwrap();
    assert!((offset - truth.delay).abs() < BARS.2, "{text}");
}

#[test]
fn somebody_who_stands_is_refused_in_words() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("still");
    record(&folder, Routine::Still, 40);
    let json = dir.path().join("camera.json");
    let out = calibrate(&folder, &json);
    let err = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{err}");
    assert!(
        err.contains("a person who moves is in 0 of 40 frames"),
        "{err}"
    );
    assert!(!json.exists());
}
