//! `tryon clothcap` from outside: its files, its batches and its refusals.
#![allow(clippy::unwrap_used, missing_docs)]

use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tryon::formats::RgbdFolderWriter;
use tryon::synth::{Actor, Routine, Sequence, Setting};
use tryon_bench::scans::{ScanScene, write_scan_folder};

fn clothcap(args: &[&str]) -> Output {
    let mut c = Command::new(env!("CARGO_BIN_EXE_tryon"));
    c.arg("clothcap").args(args).output().unwrap()
}

#[track_caller]
fn succeeds(args: &[&str]) {
    let out = clothcap(args);
    let err = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{args:?}: {err}");
}

fn json_of(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

fn changed(path: &Path) -> std::time::SystemTime {
    std::fs::metadata(path).unwrap().modified().unwrap()
}

/// Scans of a T-shirt and trousers in a folder.
fn dressed_scans(folder: &Path, scans: usize) -> PathBuf {
    let mut scene = ScanScene::library(&["trousers", "tshirt"]).unwrap();
    (scene.scans, scene.scanner.points) = (scans, 20_000);
    let out = folder.join("scans");
    write_scan_folder(&out, &scene).unwrap();
    out
}

#[test]
fn garments_are_captured_from_scans() {
    let folder = tempfile::tempdir().unwrap();
    let scans = dressed_scans(folder.path(), 2);
    let scans = scans.to_str().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();

    succeeds(&["segment", "--scans", scans, "--out", &at("labels")]);
    let names = json_of(&folder.path().join("labels/labels.json"));
    assert_eq!(names["1"]["name"], json!("top"));
    assert_eq!(names["2"]["name"], json!("bottom"));

    let out = at("capture");
    let capture = ["capture", "--scans", scans, "--out", &out];
    succeeds(&capture);
    let header = folder.path().join("capture/capture.json");
    let before = changed(&header);
    // A second run finds everything done.
    succeeds(&capture);
    assert_eq!(changed(&header), before);
}

#[test]
fn jobs_of_a_batch_share_the_bodies_and_leave_what_is_done() {
    let folder = tempfile::tempdir().unwrap();
    let scans = dressed_scans(folder.path(), 1);
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (outfit, bodies) = (at("outfit"), at("bodies"));
    succeeds(&[
        "capture",
        "--scans",
        scans.to_str().unwrap(),
        "--out",
        &outfit,
    ]);

    let retarget = |count: &str, shard: &str| {
        let job = ["--population", count, "--shard", shard];
        let files = ["retarget", "--capture", &outfit, "--out", &bodies];
        clothcap(&[&files[..], &job].concat())
    };
    assert!(retarget("2", "0/1").status.success());
    let report = json_of(&folder.path().join("bodies/report.json"));
    let rows = report["bodies"].as_array().unwrap();
    assert_eq!(rows.len(), 2);
    for frame in rows.iter().flat_map(|b| b["frames"].as_array().unwrap()) {
        for garment in frame.as_array().unwrap() {
            assert_eq!(garment["inside"], 0, "{garment}");
        }
    }
    let file = folder.path().join("bodies/0001.glb");
    assert_eq!(&std::fs::read(&file).unwrap()[..4], b"glTF");

    let before = changed(&file);
    assert!(retarget("3", "0/2").status.success());
    assert!(retarget("3", "1/2").status.success());
    assert_eq!(changed(&file), before);
    assert!(folder.path().join("bodies/0002.glb").exists());
    assert_eq!(retarget("3", "2/2").status.code(), Some(2));
}

#[test]
fn a_skirt_is_put_on_other_bodies_with_its_texture() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = ScanScene::library(&["skirt", "tshirt"]).unwrap();
    (scene.scans, scene.scanner.points) = (1, 20_000);
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (scans, outfit, bodies) = (at("scans"), at("outfit"), at("bodies"));
    write_scan_folder(Path::new(&scans), &scene).unwrap();
    succeeds(&["capture", "--scans", &scans, "--out", &outfit]);
    let retarget = ["retarget", "--capture", &outfit, "--out", &bodies];
    succeeds(&[&retarget[..], &["--population", "2", "--obj"]].concat());

    let report = json_of(&folder.path().join("bodies/report.json"));
    let rows = report["bodies"].as_array().unwrap();
    for frame in rows.iter().flat_map(|b| b["frames"].as_array().unwrap()) {
        for garment in frame.as_array().unwrap() {
            assert_eq!(garment["inside"], 0, "{garment}");
        }
    }
    let at_body = |name: &str| folder.path().join("bodies").join(name);
    let materials = std::fs::read_to_string(at_body("0001.mtl")).unwrap();
    assert!(materials.contains("map_Kd 0001_bottom.png"), "{materials}");
    assert!(at_body("0001_bottom.png").exists() && at_body("0001.obj").exists());

    // The sheet of a batch that continues shows the bodies that were done before, too.
    let sheet = std::fs::read(at_body("sheet.png")).unwrap();
    std::fs::remove_file(at_body("0001.json")).unwrap();
    succeeds(&[&retarget[..], &["--population", "2", "--obj"]].concat());
    assert_eq!(std::fs::read(at_body("sheet.png")).unwrap(), sheet);
}

#[test]
fn scans_that_show_nobody_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let refused = |scans: &Path| {
        let done = clothcap(&["capture", "--scans", scans.to_str().unwrap(), "--out", out]);
        let err = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(1), "{err}");
        assert!(!err.contains("panicked"), "{err}");
        err
    };
    let empty = folder.path().join("empty");
    std::fs::create_dir_all(&empty).unwrap();
    assert!(refused(&empty).contains("empty"));

    let cut = folder.path().join("cut.ply");
    let header = "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\n";
    std::fs::write(&cut, header).unwrap();
    assert!(refused(&cut).contains("cut.ply"));

    let nothing = folder.path().join("nothing.glb");
    std::fs::write(&nothing, "").unwrap();
    let err = refused(&nothing);
    assert!(
        err.contains("nothing.glb") && err.contains("empty"),
        "{err}"
    );

    let mut post = String::from(
        "ply\nformat ascii 1.0\nelement vertex 2000\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
    );
    for i in 0..2000 {
        let angle = f64::from(i) * 2.4;
        let [x, z] = [0.05 * angle.cos(), 0.05 * angle.sin()];
        post += &format!("{x} {} {z}\n", f64::from(i) * 9e-4);
    }
    let file = folder.path().join("post.ply");
    std::fs::write(&file, post).unwrap();
    assert!(refused(&file).contains("no person"));
}

#[test]
fn a_recording_or_scans_are_wanted_and_recordings_without_people_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let out = at("out");
    let capture = |args: &[&str]| clothcap(&[&["capture", "--out", &out], args].concat());
    assert_eq!(capture(&[]).status.code(), Some(2));
    assert_eq!(
        capture(&["--scans", "a", "--input", "b"]).status.code(),
        Some(2)
    );
    assert_eq!(
        capture(&["--input", "b", "--unit", "1"]).status.code(),
        Some(2)
    );
    let topic = capture(&["--scans", "a", "--depth-topic", "/depth"]);
    let err = String::from_utf8_lossy(&topic.stderr).into_owned();
    assert_eq!(topic.status.code(), Some(2), "{err}");
    assert!(err.contains("--depth-topic"), "{err}");

    let setting = Setting {
        routine: Routine::Empty,
        ..Setting::default()
    };
    let room = Sequence::new(Actor::default(), setting);
    let recording = folder.path().join("room");
    let mut writer = RgbdFolderWriter::create(&recording, room.calibration()).unwrap();
    for k in 0..2 {
        writer.write(&room.frame(k).0).unwrap();
    }
    drop(writer);
    for (input, reason) in [("absent", "absent"), ("room", "nobody is found")] {
        let done = capture(&["--input", &at(input)]);
        let err = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(1), "{err}");
        assert!(err.contains(reason) && !err.contains("panicked"), "{err}");
    }

    // A recording without a calibration of its own takes one by option.
    let camera = recording.join("camera.json");
    std::fs::rename(&camera, folder.path().join("lens.json")).unwrap();
    let without = capture(&["--input", &at("room")]);
    assert!(String::from_utf8_lossy(&without.stderr).contains("camera.json"));
    let with = capture(&["--input", &at("room"), "--camera", &at("lens.json")]);
    let err = String::from_utf8_lossy(&with.stderr).into_owned();
    assert!(err.contains("nobody is found"), "{err}");
}
