//! Recordings by the writers of the trade (`testdata/recordings/make_recordings.py`) against what the same libraries read,
//! and the same files damaged.

use crate::recording::{open_as_recorded, open_as_recorded_with};
use crate::{CameraFile, FormatError, RecordingOptions};
use nalgebra::Vector3;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{Distortion, Lens, RgbdFrame};

const FILES: [&str; 8] = [
    "ros1_stored.bag",
    "ros1_bz2.bag",
    "ros1_lz4.bag",
    "realsense.bag",
    "ros2_sqlite",
    "ros2_mcap",
    "compressed_ros1.mcap",
    "compressed_ros2.mcap",
];

pub(super) fn recording(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("testdata/recordings")
        .join(name)
}

pub(super) fn expected() -> Value {
    let text = fs::read(recording("expected.json")).expect("a committed file");
    serde_json::from_slice(&text).expect("JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    let all = value.as_array().expect("an array").iter();
    all.map(|v| v.as_f64().expect("a number")).collect()
}

pub(super) fn check_frame(frame: &RgbdFrame, want: &Value, name: &str) {
    assert_eq!(Some(frame.time_ns), want["time_ns"].as_u64(), "{name}");
    let depth: Vec<f64> = frame.depth.data().iter().map(|d| f64::from(*d)).collect();
    assert_eq!(depth, numbers(&want["depth"]), "{name}");
    let mut crc = flate2::Crc::new();
    crc.update(frame.color.as_ref().expect("colour").data());
    assert_eq!(
        Some(u64::from(crc.sum())),
        want["color_crc32"].as_u64(),
        "{name}"
    );
}

fn check_lens(lens: &Lens, want: &Value, name: &str) {
    let k = lens.intrinsics;
    let size = [f64::from(k.width), f64::from(k.height)];
    assert_eq!(size[..], numbers(&want["size"]), "{name}");
    let matrix = [k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0];
    assert_eq!(matrix[..], numbers(&want["k"]), "{name}");
    let d = Distortion::from_opencv(&numbers(&want["d"])).expect("coefficients");
    assert_eq!(lens.distortion, d, "{name}");
}

#[test]
fn pixels_times_and_cameras_are_those_that_other_libraries_read() {
    let expected = expected();
    for name in FILES {
        let mut source = open_as_recorded(&recording(name)).unwrap_or_else(|e| panic!("{e}"));
        let want = &expected[name];
        let frames = want["frames"].as_array().expect("frames");
        for round in 0..2 {
            let mut last = None;
            for f in frames {
                let frame = source.next_frame().unwrap_or_else(|e| panic!("{e}"));
                let frame = frame.expect("a frame");
                check_frame(&frame, f, name);
                // ROS 2 has no sequence numbers, and the ROS 1 headers here repeat theirs.
                assert!(last.is_none_or(|l| frame.sequence == l + 1), "{name}");
                last = Some(frame.sequence);
            }
            assert!(
                source.next_frame().is_ok_and(|f| f.is_none()),
                "{name} {round}"
            );
            source.rewind().expect("rewinds");
        }
        let lenses = source.lenses();
        check_lens(&lenses.depth, &want["cameras"]["depth"], name);
        match &want["cameras"]["color"] {
            Value::Null => assert_eq!(lenses.color, None, "{name}"),
            camera => check_lens(&lenses.color.expect("a camera"), camera, name),
        }
    }
}

#[test]
fn transforms_place_the_color_camera() {
    // Optical frames look along the link's x; colour is 25 mm to the right and 2 mm up.
    let ros = Vector3::new(-0.025, 0.002, 0.0);
    let sdk = Vector3::new(0.0149, 0.0002, -0.0003);
    for (name, want) in [
        ("ros1_stored.bag", ros),
        ("ros2_sqlite", ros),
        ("ros2_mcap", ros),
        ("realsense.bag", sdk),
    ] {
        let source = open_as_recorded(&recording(name)).expect("opens");
        let pose = *source.lenses().color_from_depth.iso();
        let off = (pose.translation.vector - want).norm();
        assert!(
            off < 1e-12 && pose.rotation.angle() < 1e-7,
            "{name}: {pose}"
        );
    }
}

/// The calibration of a recording, written to a file with another clock of colour and given back to it.
#[test]
fn a_written_camera_file_calibrates_the_recording_it_is_of() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let json = dir.path().join("camera.json");
    for name in ["ros1_lz4.bag", "ros2_mcap"] {
        let mut plain = open_as_recorded(&recording(name)).expect("opens");
        let file = CameraFile {
            color_time_offset_s: 0.001,
            ..plain.camera_file()
        };
        file.write(&json).expect("written");
        let options = RecordingOptions {
            camera: Some(json.clone()),
            ..RecordingOptions::default()
        };
        let mut shifted = open_as_recorded_with(&recording(name), &options).expect("opens");
        let (a, b) = (plain.next_frame(), shifted.next_frame());
        assert_eq!(a.expect("reads"), b.expect("reads"), "{name}");
        let [before, after] = [&plain, &shifted].map(|s| s.color_time_ns().expect("stamped"));
        assert_eq!(after, before + 1_000_000, "{name}");

        let got = shifted.camera_file();
        let turn = got.lenses.color_from_depth.inverse() * file.lenses.color_from_depth;
        assert!(turn.iso().rotation.angle() < 1e-9, "{name}");
        let off = turn.iso().translation.vector.norm();
        assert!(
            off < 1e-12 && got.lenses.depth == file.lenses.depth,
            "{name}"
        );
        assert_eq!(got.lenses.color, file.lenses.color, "{name}");
        assert!((got.depth_scale - file.depth_scale).abs() < 1e-9, "{name}");
    }
}

#[test]
fn other_topics_are_named_and_infrared_is_choosable() {
    let source = open_as_recorded(&recording("ros2_mcap")).expect("opens");
    let notes = source.untaken();
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].contains("`/cam/infra1/image_raw` (mono8 12×9): infrared"));
    assert!(notes[1].contains("`/cam/imu` (sensor_msgs/msg/Imu)"));

    let options = RecordingOptions {
        color_topic: Some("/cam/infra1/image_raw".into()),
        ..RecordingOptions::default()
    };
    let path = recording("ros1_lz4.bag");
    let mut source = open_as_recorded_with(&path, &options).expect("opens");
    assert_eq!(source.calibration().color, None, "registered to depth");
    let frame = source.next_frame().expect("reads").expect("a frame");
    assert!(
        frame
            .color
            .is_some_and(|c| c.data().iter().all(|v| *v == 40))
    );
    let notes = source.untaken().join("\n");
    assert!(notes.contains("`/cam/color/image_raw`"), "{notes}");

    let source = open_as_recorded(&recording("realsense.bag")).expect("opens");
    let notes = source.untaken().join("\n");
    assert!(notes.contains("16-bit grey is taken as depth"), "{notes}");
}

/// A copy of a recording whose file is damaged.
struct DamagedCopy {
    folder: tempfile::TempDir,
    file: PathBuf,
    whole: Vec<u8>,
}

impl DamagedCopy {
    fn of(name: &str) -> Self {
        let folder = tempfile::tempdir().expect("temporary folder");
        let (from, mut file) = (recording(name), folder.path().join(name));
        if !from.is_dir() {
            let whole = fs::read(&from).expect("read");
            return Self {
                folder,
                file,
                whole,
            };
        }
        fs::create_dir(&file).expect("created");
        for entry in fs::read_dir(&from).expect("read") {
            let entry = entry.expect("an entry").path();
            let to = file.join(entry.file_name().expect("a name"));
            fs::copy(&entry, &to).expect("copied");
        }
        let inner = fs::read_dir(&file)
            .expect("read")
            .map(|e| e.expect("an entry").path());
        let data = inner
            .into_iter()
            .find(|p| p.extension().is_some_and(|e| e != "yaml"));
        file = data.expect("a file beside metadata.yaml");
        let whole = fs::read(&file).expect("read");
        Self {
            folder,
            file,
            whole,
        }
    }

    /// Frames of the recording with these bytes; an error for each frame at fault.
    fn read(
        &self,
        name: &str,
        bytes: &[u8],
    ) -> Result<Vec<Result<RgbdFrame, FormatError>>, FormatError> {
        fs::write(&self.file, bytes).expect("written");
        let mut source = open_as_recorded(&self.folder.path().join(name))?;
        let mut frames = Vec::new();
        for _ in 0..1000 {
            match source.next_frame() {
                Ok(None) => return Ok(frames),
                Ok(Some(frame)) => frames.push(Ok(frame)),
                Err(e) => frames.push(Err(e)),
            }
        }
        panic!("{name} does not end");
    }
}

#[test]
fn truncated_files_keep_whole_frames_or_name_their_fault() {
    for name in FILES {
        let copy = DamagedCopy::of(name);
        let whole = copy.read(name, &copy.whole).expect("opens");
        let file = copy
            .file
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        for at in (0..copy.whole.len()).step_by(copy.whole.len() / 97) {
            match copy.read(name, &copy.whole[..at]) {
                Err(e) => assert!(e.to_string().contains(&file) || e.to_string().contains(name)),
                Ok(frames) => {
                    assert!(frames.len() <= whole.len(), "{name} cut at {at}");
                    for (got, want) in frames.iter().flatten().zip(whole.iter().flatten()) {
                        assert_eq!(got.depth, want.depth, "{name} cut at {at}");
                    }
                }
            }
        }
    }
}

/// Damaged copies of each file, or `TRYON_DAMAGED_FILES`.
const DAMAGED_FILES: usize = 300;

#[test]
fn damaged_files_never_panic_and_end() {
    let count = std::env::var("TRYON_DAMAGED_FILES").ok();
    let count = count.and_then(|n| n.parse().ok()).unwrap_or(DAMAGED_FILES);
    for name in FILES {
        let copy = DamagedCopy::of(name);
        let mut x = 0x9e37_79b9_7f4a_7c15u64;
        let mut random = |n: usize| {
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
            (x >> 20) as usize % n
        };
        let (mut opened, mut read) = (0, 0);
        for _ in 0..count {
            let mut bytes = copy.whole.clone();
            for _ in 0..=random(4) {
                let at = random(bytes.len());
                match random(4) {
                    0 => bytes[at] = 0xff,
                    1 => bytes[at] ^= 1 << random(8),
                    2 => bytes[at] = random(256) as u8,
                    _ => {
                        let end = (at + 8).min(bytes.len());
                        bytes[at..end].fill(random(256) as u8);
                    }
                }
            }
            if let Ok(frames) = copy.read(name, &bytes) {
                opened += 1;
                read += frames.iter().flatten().count();
            }
        }
        eprintln!("{name}: {opened} of {count} damaged copies open, {read} frames read");
    }
}
