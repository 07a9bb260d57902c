//! Streams that are late, damaged, apart, alone, and gone for a while.

use crate::cameras::{Cameras, PATIENCE, next, numbers};
use std::io::Write;
use std::sync::{Arc, Mutex};
use std::time::Instant;

#[test]
fn inverse_depth_and_png_are_read_to_the_pixel() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(cameras) = Cameras::start(folder.path()) else {
        return;
    };
    let mut source = cameras.open("inverse");
    let (mut colored, begun) = (0, Instant::now());
    while colored < 6 {
        assert!(begun.elapsed() < PATIENCE, "{colored}");
        let frame = next(&mut source);
        let k = cameras.picture("inverse", &frame);
        let Some(color) = frame.color else { continue };
        let got: Vec<u64> = color.data().iter().map(|c| u64::from(*c)).collect();
        let pictures = &cameras.expected["inverse"]["pictures"];
        assert_eq!(got, numbers(&pictures[k]["color"]));
        colored += 1;
    }
}

#[test]
fn depth_alone_is_a_camera() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(cameras) = Cameras::start(folder.path()) else {
        return;
    };
    let mut source = cameras.open("alone");
    assert_eq!(source.calibration().color, None);
    for _ in 0..6 {
        let frame = next(&mut source);
        cameras.picture("alone", &frame);
        assert!(frame.color.is_none());
    }
}

/// Text of what is logged in this process.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl Log {
    /// Takes the log of all threads: with a subscriber of one thread, events that another one meets first may stay off.
    fn begin() -> Self {
        let log = Self::default();
        let writer = log.clone();
        let subscriber = tracing_subscriber::fmt()
            .with_ansi(false)
            .with_writer(move || writer.clone());
        tracing::subscriber::set_global_default(subscriber.finish()).expect("the only log");
        log
    }

    /// Lines that name a source.
    fn lines(&self, source: &str) -> Vec<String> {
        let bytes = self.0.lock().expect("no panic").clone();
        let text = String::from_utf8(bytes).expect("text");
        let lines = text.lines().filter(|l| l.contains(source));
        lines.map(str::to_owned).collect()
    }
}

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().expect("no panic").extend(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn streams_that_do_not_belong_together_are_said_once_with_their_offset() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(cameras) = Cameras::start(folder.path()) else {
        return;
    };
    let log = Log::begin();
    let mut source = cameras.open("apart");
    for _ in 0..40 {
        assert!(next(&mut source).color.is_none());
    }
    let lines = log.lines(&cameras.source("apart"));
    let of = |text: &str| -> Vec<&String> { lines.iter().filter(|l| l.contains(text)).collect() };
    let said = of("goes without colour");
    assert_eq!(said.len(), 1, "{lines:?}");
    // Colour is 5 s ahead; which of the waiting ones is nearest depends on their arrival.
    let (_, offset) = said[0].split_once("colour's is +").expect("an offset");
    let offset = offset.split(' ').next().and_then(|o| o.parse().ok());
    let offset: f64 = offset.expect("milliseconds");
    assert!((4000.0..=5200.0).contains(&offset), "{offset}");
    assert_eq!(
        of("no transform from `apart_depth_optical`").len(),
        1,
        "{lines:?}"
    );
}

#[test]
fn damaged_messages_are_faults_of_their_frames_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(cameras) = Cameras::start(folder.path()) else {
        return;
    };
    let mut source = cameras.open("broken");
    let (mut fine, mut faults, begun) = (0, 0, Instant::now());
    while fine < 3 || faults < 3 {
        assert!(begun.elapsed() < PATIENCE, "{fine} {faults}");
        match source.next_frame() {
            Ok(Some(frame)) => {
                cameras.picture("broken", &frame);
                fine += 1;
            }
            Ok(None) => panic!("the end"),
            Err(e) => {
                assert!(e.to_string().contains("/broken/depth/image_raw"), "{e}");
                faults += 1;
            }
        }
    }
}

#[test]
fn a_network_that_comes_back_is_found_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(cameras) = Cameras::start(folder.path()) else {
        return;
    };
    let mut source = cameras.open("raw");
    cameras.picture("raw", &next(&mut source));
    let cameras = cameras.restart(folder.path());
    // One depth image at most has waited from before.
    let begun = Instant::now();
    for _ in 0..6 {
        let frame = next(&mut source);
        cameras.picture("raw", &frame);
        assert!(begun.elapsed() < PATIENCE);
    }
}
