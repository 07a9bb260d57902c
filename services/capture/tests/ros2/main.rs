//! Cameras of ROS 2: messages that `rosbags` serialised, on a network of zenoh's Python client (`ros2/publisher.py`).

mod common;

use common::{camera, hold, start_with};
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};
use tryon_capture_service::{OpenSource, open_with};
use tryon_formats::open_recording;
use tryon_geometry::camera::RgbdFrame;
use tryon_kit::bus::free_tcp_endpoint;
use tryon_kit::config::Ros2Config;
use tryon_proto::v1::*;

/// Longest wait for what has to come.
const PATIENCE: Duration = Duration::from_secs(20);
/// Largest difference of two decoders of one JPEG, levels: the standard leaves their arithmetic open.
const JPEG: i32 = 2;

/// The cameras, and the names and pictures of their streams.
struct Cameras {
    process: Child,
    lines: Receiver<String>,
    network: Ros2Config,
    expected: Value,
}

impl Drop for Cameras {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Cameras {
    /// `None` where Python lacks a package, which fails with `TRYON_REQUIRE_ALL=1`.
    fn start(folder: &Path) -> Option<Self> {
        let import = ["-c", "import numpy, PIL, rosbags, zenoh"];
        let found = Command::new("python3").args(import).output();
        if !found.is_ok_and(|o| o.status.success()) {
            assert!(
                std::env::var_os("TRYON_REQUIRE_ALL").is_none_or(|v| v != "1"),
                "Python lacks numpy, pillow, rosbags or eclipse-zenoh"
            );
            eprintln!("SKIPPED: Python lacks numpy, pillow, rosbags or eclipse-zenoh");
            return None;
        }
        let endpoint = free_tcp_endpoint().expect("a port");
        let expected = folder.join("expected.json");
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ros2/publisher.py");
        let mut process = Command::new("python3")
            .args([&script, Path::new(&endpoint), &expected])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("started");
        let out = BufReader::new(process.stdout.take().expect("piped"));
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            let mut lines = out.lines().map_while(Result::ok);
            while lines.next().is_some_and(|l| sender.send(l).is_ok()) {}
        });
        let mut cameras = Self {
            process,
            lines,
            network: Ros2Config {
                connect: vec![endpoint],
                namespace: "robot1".into(),
                ..Ros2Config::default()
            },
            expected: Value::Null,
        };
        cameras.wait_for(&["ready"]);
        let text = std::fs::read(expected).expect("written");
        cameras.expected = serde_json::from_slice(&text).expect("JSON");
        Some(cameras)
    }

    /// Waits for lines, in any order.
    fn wait_for(&self, lines: &[&str]) {
        let end = Instant::now() + PATIENCE;
        let mut left = lines.to_vec();
        while !left.is_empty() {
            let wait = end.saturating_duration_since(Instant::now());
            let came = self.lines.recv_timeout(wait);
            let came = came.unwrap_or_else(|_| panic!("missing: {left:?}"));
            left.retain(|l| *l != came);
        }
    }

    fn topic(&self, camera: &str, stream: &str) -> String {
        let topic = &self.expected[camera]["topics"][stream];
        topic.as_str().expect("a topic").to_owned()
    }

    /// Source of a camera, with its colour if it has one.
    fn source(&self, camera: &str) -> String {
        let depth = self.topic(camera, "depth");
        match &self.expected[camera]["topics"]["color"] {
            Value::String(color) => format!("ros2:{depth},{color}"),
            _ => format!("ros2:{depth}"),
        }
    }

    fn open(&self, camera: &str) -> OpenSource {
        open_with(&self.source(camera), &self.network).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Number of the picture that a frame shows: its depth is that of the picture to the millimetre.
    fn picture(&self, camera: &str, frame: &RgbdFrame) -> usize {
        let got: Vec<u64> = frame.depth.data().iter().map(|d| u64::from(*d)).collect();
        let pictures = self.expected[camera]["pictures"].as_array();
        let mut pictures = pictures.expect("pictures").iter();
        let found = pictures.position(|p| numbers(&p["depth"]) == got);
        found.unwrap_or_else(|| panic!("{camera}: no picture has this depth: {got:?}"))
    }
}

fn numbers(value: &Value) -> Vec<u64> {
    let all = value.as_array().expect("numbers").iter();
    all.map(|v| v.as_u64().expect("a number")).collect()
}

fn next(source: &mut OpenSource) -> RgbdFrame {
    source.next_frame().expect("whole").expect("it never ends")
}

#[test]
fn pictures_are_those_that_were_serialised_under_both_forms_of_keys() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(cameras) = Cameras::start(folder.path()) else {
        return;
    };
    for (camera, difference) in [
        ("raw", 0),
        ("metres", JPEG),
        ("small", JPEG),
        ("bridged", 0),
    ] {
        let mut source = cameras.open(camera);
        let (mut seen, mut last, begun) = ([false; 4], 0, Instant::now());
        while seen != [true; 4] {
            assert!(begun.elapsed() < PATIENCE, "{camera}: {seen:?}");
            let frame = next(&mut source);
            let k = cameras.picture(camera, &frame);
            assert!(frame.time_ns > last, "{camera}: times grow");
            last = frame.time_ns;
            // On a busy machine colour may be too late.
            let Some(color) = frame.color else { continue };
            let want = numbers(&cameras.expected[camera]["pictures"][k]["color"]);
            let pixels = color.data().iter().zip(&want);
            let worst = pixels.map(|(a, b)| (i32::from(*a) - *b as i32).abs()).max();
            assert!(
                worst.is_some_and(|w| w <= difference),
                "{camera}: {worst:?}"
            );
            seen[k] = true;
        }
        let calibration = source.calibration();
        let (depth, color) = (calibration.depth, calibration.color.expect("its own"));
        assert_eq!((depth.width, depth.fx, depth.cy), (16, 20.5, 5.25));
        assert_eq!((color.height, color.fy, color.cx), (32, 43.5, 23.75));
        let to_color = calibration.color_from_depth.iso().translation.vector;
        // Of one camera alone the transforms are known; optical frames have x to the right and y down.
        let want = match camera {
            "raw" => [-0.025, 0.002, 0.0],
            _ => [0.0; 3],
        };
        let off = to_color.iter().zip(want).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-12, "{camera}: {to_color}");
    }
}

#[test]
fn who_configures_is_told_what_there_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(cameras) = Cameras::start(folder.path()) else {
        return;
    };
    let refused = |source: &str, network: &Ros2Config| {
        open_with(source, network)
            .err()
            .expect("refused")
            .to_string()
    };
    let e = refused("ros2:/camera/depth/image_rect_raw", &cameras.network);
    assert!(e.starts_with("ros2:/camera/depth/image_rect_raw: "), "{e}");
    for named in [
        "/camera/depth/camera_info",
        "`/raw/depth/image_raw`",
        "domain 0",
        "`/bridged/color/image_raw`",
    ] {
        assert!(e.contains(named), "{named}: {e}");
    }
    assert!(
        !e.contains("tf_static") && !e.contains("`/raw/depth/camera_info`"),
        "{e}"
    );
    let nowhere = Ros2Config {
        connect: vec![free_tcp_endpoint().expect("a port")],
        ..cameras.network.clone()
    };
    let e = refused(&cameras.source("raw"), &nowhere);
    assert!(e.contains(&nowhere.connect[0]), "{e}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn images_are_subscribed_to_only_while_somebody_consents() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(cameras) = Cameras::start(folder.path()) else {
        return;
    };
    let network = format!("capture.ros2.connect={:?}", cameras.network.connect);
    let (_process, url) = start_with(folder.path(), &cameras.source("raw"), &[network]);
    let mut client = common::Client::connect(url).await.expect("connected");
    let topics = [cameras.topic("raw", "depth"), cameras.topic("raw", "color")];
    let on = topics.each_ref().map(|t| format!("{t} on"));
    let on = on.each_ref().map(String::as_str);
    let off = topics.each_ref().map(|t| format!("{t} off"));
    let off = off.each_ref().map(String::as_str);
    cameras.wait_for(&["/raw/depth/camera_info on"]);
    cameras.wait_for(&["/raw/depth/camera_info off"]);
    while camera(&mut client).await.state() != CameraState::Running {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    // Some frames' time, in which nobody consents.
    tokio::time::sleep(Duration::from_millis(400)).await;
    let mut lines = cameras.lines.try_iter();
    assert!(!lines.any(|l| on.contains(&l.as_str())));
    assert_eq!(camera(&mut client).await.frames, 0);

    hold(&mut client).await;
    cameras.wait_for(&on);
    let request = StartRecordingRequest {
        camera: "front".into(),
        consent: true,
    };
    let begun = client.start_recording(request).await.expect("begun");
    let file = begun.into_inner().file;
    tokio::time::sleep(Duration::from_millis(600)).await;
    let stop = StopRecordingRequest {
        camera: "front".into(),
    };
    let end = client.stop_recording(stop).await.expect("ended");
    assert!(end.into_inner().frames > 0);
    let ended = HoldConsentRequest {
        camera: "front".into(),
        try_on_id: "somebody".into(),
        ..Default::default()
    };
    client.hold_consent(ended).await.expect("ended");
    cameras.wait_for(&off);
    let shown = camera(&mut client).await;
    assert_eq!(shown.source, cameras.source("raw"));

    let mut recording = open_recording(&folder.path().join(file)).expect("readable");
    let frame = recording.next_frame().expect("whole").expect("a frame");
    cameras.picture("raw", &frame);

    // Consent again: subscribed again.
    hold(&mut client).await;
    cameras.wait_for(&on);
    let before = camera(&mut client).await.frames;
    while camera(&mut client).await.frames <= before {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}
