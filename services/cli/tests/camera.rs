//! `tryon camera` from outside: its output, its pictures and its exit codes.
#![allow(clippy::unwrap_used, missing_docs)]

#[path = "../../devices/tests/common/mod.rs"]
mod replay;

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use tryon::formats::image::read_color;
use tryon::formats::open_recording;
use tryon::geometry::camera::RgbdFrame;
use tryon::synth::{Actor, Routine, Sequence, Setting};

fn tryon(args: &[&str]) -> Output {
    let mut c = Command::new(env!("CARGO_BIN_EXE_tryon"));
    // Software Vulkan writes a warning without a desktop session.
    c.args(args)
        .env("XDG_RUNTIME_DIR", std::env::temp_dir())
        .output()
        .expect("starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Standard output of a command that must not fail.
#[track_caller]
fn said(args: &[&str]) -> String {
    let out = tryon(args);
    assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
    text(&out.stdout)
}

/// JSON of a command, and its exit code.
#[track_caller]
fn json(args: &[&str]) -> (Value, Option<i32>) {
    let out = tryon(args);
    let value = serde_json::from_slice(&out.stdout);
    let fault = || format!("{args:?}: {}", text(&out.stderr));
    (
        value.unwrap_or_else(|_| panic!("{}", fault())),
        out.status.code(),
    )
}

/// Verdict of a finding.
#[track_caller]
fn verdict<'a>(checked: &'a Value, what: &str) -> (&'a str, &'a str) {
    let all = checked["findings"].as_array().unwrap();
    let found = all.iter().find(|f| f["what"] == what);
    let found = found.unwrap_or_else(|| panic!("{what} is missing in {checked:#}"));
    (
        found["verdict"].as_str().unwrap(),
        found["detail"].as_str().unwrap(),
    )
}

/// A frame of the source `synth:ROUTINE`.
fn frame(routine: Routine, number: u64) -> RgbdFrame {
    let setting = Setting {
        routine,
        ..Setting::default()
    };
    Sequence::new(Actor::default(), setting).frame(number).0
}

#[test]
fn each_command_explains_itself() {
    for command in ["list", "view", "check"] {
        let help = said(&["camera", command, "--help"]);
        assert!(
            help.contains(&format!("Usage: tryon camera {command}")),
            "{help}"
        );
    }
    for command in ["view", "check"] {
        let help = said(&["camera", command, "--help"]);
        for flag in ["--turned", "--mirrored", "--depth-topic", "--seconds"] {
            assert!(help.contains(flag), "{command}: {help}");
        }
    }
    for command in ["run", "track", "import"] {
        let help = said(&[command, "--help"]);
        assert!(
            help.contains("--turned") && help.contains("--mirrored"),
            "{help}"
        );
    }
}

#[test]
fn families_are_listed_with_what_they_lack_and_by_doctor_too() {
    let list = said(&["camera", "list"]);
    let families = [
        "freenect",
        "openni",
        "v4l2",
        "realsense",
        "azure kinect",
        "orbbec",
        "oak",
    ];
    for family in families {
        let line = list.lines().find(|l| l[5..].starts_with(family));
        assert!(line.is_some(), "{family} is missing in\n{list}");
    }
    assert!(
        list.contains("examples/cameras/") && list.contains("ROS 2"),
        "{list}"
    );
    let doctor = text(&tryon(&["doctor"]).stdout);
    for line in list.lines() {
        assert!(doctor.contains(line), "{line} is missing in\n{doctor}");
    }

    let (listed, code) = json(&["camera", "list", "--json"]);
    assert_eq!(code, Some(0));
    let own = listed["families"].as_array().unwrap();
    assert_eq!(own.len(), 3);
    for family in own {
        assert!(family["cameras"].is_array(), "{family:#}");
        let is_told =
            family["missing"].is_null() || !family["missing"].as_str().unwrap().is_empty();
        assert!(is_told, "{family:#}");
    }
    assert_eq!(listed["fed"].as_array().unwrap().len(), 4);
}

#[test]
fn a_picture_shows_depth_beside_colour() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("view.png");
    let path = out.display().to_string();
    let printed = said(&[
        "camera",
        "view",
        "synth:empty",
        "--seconds",
        "0.2",
        "--out",
        &path,
    ]);
    assert_eq!(printed.trim(), path);
    let picture = read_color(&out).unwrap();
    assert_eq!((picture.width(), picture.height()), (640 + 4 + 640, 480));
    // The last frame within 0.2 s at 30 a second.
    let frame = frame(Routine::Empty, 5);
    let color = frame.color.unwrap();
    for (u, v) in [(10, 10), (320, 240), (600, 470)] {
        assert_eq!(picture.at(644 + u, v), color.at(u, v), "{u} {v}");
        let reading = frame.depth.at(u as i32, v as i32);
        let [r, _, b] = picture.at(u, v).map(i32::from);
        // Red nearer than the middle of 0.5 to 4.5 m, blue beyond.
        match reading {
            0 => assert_eq!(picture.at(u, v), [0; 3]),
            1..2300 => assert!(r > b, "{reading} mm at {u} {v}"),
            2700.. => assert!(b > r, "{reading} mm at {u} {v}"),
            _ => {}
        }
    }
}

#[test]
fn a_view_without_a_terminal_is_plain_text() {
    let printed = said(&["camera", "view", "synth:still", "--seconds", "2.1"]);
    assert!(!printed.contains('\x1b'), "{printed}");
    let lines: Vec<&str> = printed.lines().filter(|l| l.contains("% holes")).collect();
    assert_eq!(lines.len(), 4, "{printed}");
    assert!(lines[0].contains("first frame"), "{printed}");
    assert!(lines[3].starts_with("30.0 frames a second"), "{printed}");
    // The floor at the picture's lower edge: 1 m below, 24.6° + 3° down.
    assert!(lines[3].ends_with("nearest 2.00 m"), "{printed}");
    let rows: Vec<&str> = printed
        .lines()
        .filter(|l| l.chars().count() == 64)
        .collect();
    assert_eq!(rows.len(), 24, "{printed}");
    // The person in the middle is nearer than the wall beside.
    let at = |u: usize| rows[12].chars().nth(u).unwrap();
    let near = "@%#+-:. ";
    assert!(near.find(at(32)) < near.find(at(8)), "{printed}");
}

#[test]
fn a_good_place_is_found_good() {
    let (checked, code) = json(&["camera", "check", "synth:empty", "--seconds", "1", "--json"]);
    assert_eq!(code, Some(0), "{checked:#}");
    let place = &checked["measured"]["place"];
    let number = |value: &Value| value.as_f64().unwrap();
    // The scene: 1 m high, 3° down, level.
    let pose = &place["placement"];
    assert!((number(&pose["height"]) - 1.0).abs() < 0.02, "{pose:#}");
    assert!((number(&pose["down_deg"]) - 3.0).abs() < 0.5, "{pose:#}");
    assert!(number(&pose["roll_deg"]).abs() < 0.5, "{pose:#}");
    assert!((number(&checked["measured"]["timing"]["rate"]) - 30.0).abs() < 0.01);
    // The noise of the sensor's own model, and its steps of disparity.
    let ratio = number(&checked["measured"]["noise"]["ratio"]);
    assert!((0.9..1.4).contains(&ratio), "{ratio}");
    for what in [
        "rate",
        "clock",
        "noise",
        "holes",
        "sunlight",
        "floor surface",
        "distance",
        "floor",
        "person",
    ] {
        assert_eq!(verdict(&checked, what).0, "good", "{what}: {checked:#}");
    }
    let printed = said(&["camera", "check", "synth:empty", "--seconds", "0.5"]);
    assert_eq!(
        printed.lines().filter(|l| l.starts_with("ok  ")).count(),
        9,
        "{printed}"
    );
}

#[test]
fn a_camera_on_its_side_is_told_the_turn_and_set_right_by_it() {
    let check = |turned: &[&str]| {
        let args = [
            "camera",
            "check",
            "synth:empty",
            "--seconds",
            "0.2",
            "--json",
        ];
        json(&[&args, turned].concat()).0
    };
    let aside = check(&["--turned", "90"]);
    let (grade, detail) = verdict(&aside, "floor");
    assert_eq!(grade, "note", "{aside:#}");
    assert!(detail.contains("--turned 270"), "{detail}");
    assert_eq!(aside["measured"]["place"]["looks_turned"], 270);
}

#[test]
fn bad_places_and_bad_words_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let nowhere = dir.path().join("nowhere").display().to_string();
    let out = tryon(&["camera", "check", &nowhere]);
    let words = text(&out.stderr);
    assert_eq!(out.status.code(), Some(1));
    assert!(
        words.contains("neither a camera") && words.contains("nowhere"),
        "{words}"
    );
    let out = tryon(&["camera", "view", "synth", "--turned", "45"]);
    assert_eq!(out.status.code(), Some(2));
    assert!(text(&out.stderr).contains("45 degrees, expected 0, 90, 180 or 270"));
    for seconds in ["0", "-1", "NaN"] {
        let flag = format!("--seconds={seconds}");
        let out = tryon(&["camera", "check", "synth", &flag]);
        assert!(
            text(&out.stderr).contains("--seconds"),
            "{}",
            text(&out.stderr)
        );
        assert_eq!(out.status.code(), Some(1));
    }
    let unlikely = tryon(&["camera", "view", "freenect:no-such-camera"]);
    assert_eq!(unlikely.status.code(), Some(1));
    let words = text(&unlikely.stderr);
    assert!(words.contains("freenect"), "{words}");
}

/// Frames of a recording.
fn frames(path: &Path) -> Vec<RgbdFrame> {
    let mut recording = open_recording(path).unwrap();
    std::iter::from_fn(|| recording.next_frame().unwrap()).collect()
}

#[test]
fn recordings_are_imported_upright_and_tracked_as_such() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).display().to_string();
    let (upright, aside) = (at("upright"), at("aside"));
    said(&[
        "record",
        "--source",
        "synth:still",
        "--seconds",
        "0.3",
        "--out",
        &upright,
    ]);
    said(&[
        "import",
        &upright,
        "--turned",
        "270",
        "--mirrored",
        "--out",
        &aside,
    ]);
    let (first, turned) = (
        &frames(Path::new(&upright))[0],
        &frames(Path::new(&aside))[0],
    );
    assert_eq!((turned.depth.width(), turned.depth.height()), (480, 640));
    // Unmirrored first: the left edge, then the right one, becomes the top.
    for (u, v) in [(0, 0), (17, 300), (639, 479), (320, 240)] {
        assert_eq!(turned.depth.at(v, u), first.depth.at(u, v), "{u} {v}");
    }

    let joints = |input: &str, more: &[&str]| {
        let out = at("track.jsonl");
        let args = ["track", "--input", input, "--out", &out];
        said(&[&args, more].concat());
        let lines = std::fs::read_to_string(&out).unwrap();
        let last: Value = serde_json::from_str(lines.lines().last().unwrap()).unwrap();
        (last["status"].clone(), last["joints"].clone())
    };
    let want = joints(&upright, &[]);
    assert!(
        want.0 == "calibrating" || want.0 == "tracking",
        "{}",
        want.0
    );
    // The same reflection sets it right: it swaps rows and columns.
    assert_eq!(joints(&aside, &["--turned", "270", "--mirrored"]), want);
}

/// The command in a process for which a recording of a Kinect is plugged in; `None` where the replay is missing.
fn with_kinect(folder: &Path, args: &[&str]) -> Option<Output> {
    let library = replay::replay_library()?;
    let mut c = Command::new(env!("CARGO_BIN_EXE_tryon"));
    c.args(args).env("XDG_RUNTIME_DIR", std::env::temp_dir());
    c.env("LD_LIBRARY_PATH", library)
        .env("FAKENECT_PATH", folder);
    Some(c.output().expect("starts"))
}

#[test]
fn a_camera_that_is_plugged_in_is_listed_shown_and_checked() {
    let dir = tempfile::tempdir().unwrap();
    // Ten seconds of 30 images each.
    replay::write_recording(dir.path(), 6, 50, 7);
    let Some(out) = with_kinect(dir.path(), &["camera", "list", "--json"]) else {
        return;
    };
    let listed: Value = serde_json::from_slice(&out.stdout).unwrap();
    let camera = &listed["families"][0]["cameras"][0];
    let source = camera["source"].as_str().unwrap();
    assert!(source.starts_with("freenect:"), "{listed:#}");
    let modes = camera["modes"].as_array().unwrap();
    let is_depth = |m: &&Value| m["stream"] == "depth" && m["width"] == 640;
    assert!(modes.iter().any(|m| is_depth(&m)), "{listed:#}");
    let doctor = with_kinect(dir.path(), &["doctor"]).unwrap();
    assert!(
        text(&doctor.stdout).contains(source),
        "{}",
        text(&doctor.stdout)
    );

    let args = ["camera", "check", source, "--seconds", "1.5", "--json"];
    let out = with_kinect(dir.path(), &args).unwrap();
    let checked: Value = serde_json::from_slice(&out.stdout).unwrap();
    let measured = &checked["measured"];
    // Live frames have a time of arrival; the replay leaves every eleventh pixel without depth.
    assert!(
        measured["timing"]["delay_spread"].is_number(),
        "{measured:#}"
    );
    let rate = measured["timing"]["rate"].as_f64().unwrap();
    assert!((5.0..31.0).contains(&rate), "{measured:#}");
    let holes = measured["holes"]["middle"].as_f64().unwrap();
    assert!((holes - 1.0 / 11.0).abs() < 0.01, "{measured:#}");

    let path = dir.path().join("kinect.png").display().to_string();
    let args = ["camera", "view", source, "--out", &path, "--turned", "90"];
    let out = with_kinect(dir.path(), &args).unwrap();
    assert!(out.status.success(), "{}", text(&out.stderr));
    let picture = read_color(Path::new(&path)).unwrap();
    assert_eq!((picture.width(), picture.height()), (480 + 4 + 480, 640));
}
