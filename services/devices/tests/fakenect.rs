//! Kinect v1 by libfreenect's own replay, in a process whose loader finds it: this program again.

mod common;

use common::{COLOR_DELAY, PERIOD, PIXELS, color, disparity, replay_library, write_recording};
use std::path::Path;
use std::process::Command;
use tryon_devices::{Family, Stream, list, open};

/// Set in the process that plays.
const PLAYS: &str = "FAKENECT_PATH";
const IMAGES: u32 = 6;
/// Clock at the first image: it turns over at the third.
const TICKS: u32 = u32::MAX - 5_000_000;

/// Runs a test of this file in a process that plays the recording; false in that process.
fn in_replay(test: &str, folder: &Path) -> bool {
    let Some(library) = replay_library() else {
        return true;
    };
    let program = std::env::current_exe().expect("this program");
    let mut command = Command::new(program);
    command.args(["--exact", test, "--nocapture"]);
    command.env("LD_LIBRARY_PATH", library).env(PLAYS, folder);
    let out = command.output().expect("started");
    let text = [out.stdout, out.stderr].concat();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&text));
    true
}

fn plays() -> bool {
    std::env::var_os(PLAYS).is_some()
}

#[test]
fn frames_are_those_of_the_recording_until_it_ends() {
    if !plays() {
        let folder = tempfile::tempdir().expect("a folder");
        write_recording(folder.path(), IMAGES, 1, TICKS);
        in_replay(
            "frames_are_those_of_the_recording_until_it_ends",
            folder.path(),
        );
        return;
    }
    let mut source = open("freenect:A00362A10045").expect("opened");
    let k = source.calibration().clone();
    // Disparity is of the infrared camera; colour is 2.3 cm beside it.
    assert!((k.depth.fx - 575.8).abs() < 0.1, "{:?}", k.depth);
    assert_eq!(k.color.map(|c| c.fx), Some(525.0));
    let offset = k.color_from_depth.iso().translation.vector;
    assert!((offset.x + 0.023).abs() < 1e-9 && offset.y == 0.0 && offset.z == 0.0);
    let (mut last, mut frames): (Option<(u64, u64)>, u32) = (None, 0);
    let fault = loop {
        let frame = match source.next_frame() {
            Ok(frame) => frame.expect("endless until it fails"),
            Err(fault) => break fault.to_string(),
        };
        let image = u32::try_from(frame.sequence).expect("few");
        for (pixel, mm) in frame.depth.data().iter().enumerate() {
            let raw = disparity(image, pixel);
            // Magnenat's published calibration of the same disparities, metres.
            let want = 123.6 * (f64::from(raw) / 2842.5 + 1.1863).tan();
            let is_right = match raw {
                2047 => *mm == 0,
                _ => (f64::from(*mm) / want - 1.0).abs() < 0.03,
            };
            assert!(
                is_right,
                "image {image}, pixel {pixel}: {raw} is {mm} mm, not {want}"
            );
        }
        let rgb = frame.color.expect("of its time");
        let expected: Vec<u8> = (0..PIXELS).flat_map(|p| color(image, p)).collect();
        assert!(rgb.data() == expected, "colour of image {image}");
        if let Some((number, time_ns)) = last {
            let ticks = u64::from(PERIOD) * (frame.sequence - number);
            assert!((frame.time_ns - time_ns).abs_diff(ticks * 50 / 3) <= 1);
        }
        last = Some((frame.sequence, frame.time_ns));
        frames += 1;
    };
    assert!((4..=IMAGES).contains(&frames), "{frames} frames");
    assert!(
        fault.starts_with("freenect:A00362A10045: `freenect_process_events`"),
        "{fault}"
    );
    assert!(fault.contains("unplugged"), "{fault}");
    const { assert!(COLOR_DELAY < PERIOD / 2) };
    // Plugged in again: the same serial number, from the first image on.
    drop(source);
    let mut again = open("freenect:A00362A10045").expect("opened again");
    let frame = again.next_frame().expect("a frame").expect("endless");
    assert!(frame.sequence < 2 && frame.color.is_some());
}

#[test]
fn the_replay_is_listed_and_is_the_only_one() {
    if !plays() {
        let folder = tempfile::tempdir().expect("a folder");
        write_recording(folder.path(), 4, 1, 7);
        in_replay("the_replay_is_listed_and_is_the_only_one", folder.path());
        return;
    }
    let reports = list();
    let report = reports.iter().find(|r| r.family == Family::Freenect);
    let devices = report
        .expect("each family")
        .devices
        .clone()
        .expect("its library");
    let [device] = devices.as_slice() else {
        panic!("{devices:?}");
    };
    // The replay states no serial number: its position.
    assert_eq!(
        (device.serial.as_str(), device.name.as_str()),
        ("0", "Kinect v1")
    );
    let modes: Vec<_> = device
        .modes
        .iter()
        .map(|m| (m.stream, m.width, m.height, m.rate))
        .collect();
    assert_eq!(
        modes,
        [
            (Stream::Depth, 640, 480, 30.0),
            (Stream::Color, 640, 480, 30.0)
        ]
    );
    let mut only = open("freenect").expect("the only one");
    assert!(only.next_frame().expect("a frame").is_some());
}

#[test]
fn without_a_camera_the_real_library_says_so() {
    if plays() || replay_library().is_none() {
        return;
    }
    let report = list().into_iter().find(|r| r.family == Family::Freenect);
    let devices = report.expect("each family").devices.expect("its library");
    // This machine may have one.
    if devices.is_empty() {
        for source in ["freenect", "freenect:A00362A10045"] {
            let fault = open(source).err().expect("no camera").to_string();
            let want = format!("{source}: not plugged in; no camera of this family is plugged in");
            assert_eq!(fault, want);
        }
    }
}

#[test]
fn a_missing_library_names_its_package() {
    if std::env::var_os("TRYON_TEST_BROKEN").is_none() {
        let folder = tempfile::tempdir().expect("a folder");
        for library in ["libfreenect.so.0.5", "libOpenNI2.so.0"] {
            std::fs::write(folder.path().join(library), "no library").expect("written");
        }
        let mut command = Command::new(std::env::current_exe().expect("this program"));
        command.args([
            "--exact",
            "a_missing_library_names_its_package",
            "--nocapture",
        ]);
        command
            .env("LD_LIBRARY_PATH", folder.path())
            .env("TRYON_TEST_BROKEN", "1");
        let out = command.output().expect("started");
        assert!(
            out.status.success(),
            "{}",
            String::from_utf8_lossy(&out.stdout)
        );
        return;
    }
    for (source, package) in [("freenect:1", "libfreenect0.5"), ("openni", "libopenni2-0")] {
        for fault in [open(source).err(), tryon_devices::check(source).err()] {
            let fault = fault.expect("no library").to_string();
            assert!(
                fault.ends_with(&format!("apt-get install {package}")),
                "{fault}"
            );
        }
    }
    assert!(list().iter().filter(|r| r.devices.is_err()).count() >= 2);
}
