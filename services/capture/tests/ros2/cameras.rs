//! Cameras of `publisher.py`.

use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};
use tryon_capture_service::{OpenSource, open_with};
use tryon_geometry::camera::RgbdFrame;
use tryon_kit::bus::free_tcp_endpoint;
use tryon_kit::config::Ros2Config;

/// Longest wait for what has to come.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

/// The cameras, and the names and pictures of their streams.
pub(crate) struct Cameras {
    process: Child,
    pub(crate) lines: Receiver<String>,
    pub(crate) network: Ros2Config,
    pub(crate) expected: Value,
}

impl Drop for Cameras {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Cameras {
    /// `None` where Python lacks a package, which fails with `TRYON_REQUIRE_ALL=1`.
    pub(crate) fn start(folder: &Path) -> Option<Self> {
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
        Some(Self::run(folder, endpoint))
    }

    /// The cameras again, on the network of others that have gone.
    pub(crate) fn restart(self, folder: &Path) -> Self {
        let endpoint = self.network.connect[0].clone();
        drop(self);
        Self::run(folder, endpoint)
    }

    fn run(folder: &Path, endpoint: String) -> Self {
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
        cameras
    }

    /// Waits for lines, in any order.
    pub(crate) fn wait_for(&self, lines: &[&str]) {
        let end = Instant::now() + PATIENCE;
        let mut left = lines.to_vec();
        while !left.is_empty() {
            let wait = end.saturating_duration_since(Instant::now());
            let came = self.lines.recv_timeout(wait);
            let came = came.unwrap_or_else(|_| panic!("missing: {left:?}"));
            left.retain(|l| *l != came);
        }
    }

    pub(crate) fn topic(&self, camera: &str, stream: &str) -> String {
        let topic = &self.expected[camera]["topics"][stream];
        topic.as_str().expect("a topic").to_owned()
    }

    /// Source of a camera, with its colour if it has one.
    pub(crate) fn source(&self, camera: &str) -> String {
        let depth = self.topic(camera, "depth");
        match &self.expected[camera]["topics"]["color"] {
            Value::String(color) => format!("ros2:{depth},{color}"),
            _ => format!("ros2:{depth}"),
        }
    }

    pub(crate) fn open(&self, camera: &str) -> OpenSource {
        open_with(&self.source(camera), None, &self.network).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Number of the picture that a frame shows: its depth is that of the picture to the millimetre.
    pub(crate) fn picture(&self, camera: &str, frame: &RgbdFrame) -> usize {
        let got: Vec<u64> = frame.depth.data().iter().map(|d| u64::from(*d)).collect();
        let pictures = self.expected[camera]["pictures"].as_array();
        let mut pictures = pictures.expect("pictures").iter();
        let found = pictures.position(|p| numbers(&p["depth"]) == got);
        found.unwrap_or_else(|| panic!("{camera}: no picture has this depth: {got:?}"))
    }
}

pub(crate) fn numbers(value: &Value) -> Vec<u64> {
    let all = value.as_array().expect("numbers").iter();
    all.map(|v| v.as_u64().expect("a number")).collect()
}

pub(crate) fn next(source: &mut OpenSource) -> RgbdFrame {
    source.next_frame().expect("whole").expect("it never ends")
}
