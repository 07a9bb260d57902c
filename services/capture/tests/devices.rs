//! A camera that is plugged in: a Kinect v1 by libfreenect's own replay.

mod common;
#[path = "../../devices/tests/common/mod.rs"]
mod replay;

use common::{Client, camera, hold, start};
use replay::{PIXELS, disparity, replay_library, write_recording};
use std::time::Duration;
use tryon_formats::open_recording;
use tryon_geometry::camera::{Calibration, ColorImage, Intrinsics, RgbdFrame};
use tryon_proto::v1::*;

const IMAGES: u32 = 4;
/// Of the images: two minutes.
const ROUNDS: u32 = 900;

/// Number of the image in the replay, by its pixels without a reading.
fn image_of(frame: &RgbdFrame) -> u32 {
    let depth = frame.depth.data();
    let holes = |image: u32| (0..PIXELS).all(|p| (disparity(image, p) == 2047) == (depth[p] == 0));
    let found = (0..IMAGES).find(|i| holes(*i));
    found.expect("one of the images")
}

/// Mean of blue, which grows by 30 from image to image.
fn blue(rgb: &ColorImage) -> f64 {
    let sum: u64 = rgb
        .data()
        .iter()
        .skip(2)
        .step_by(3)
        .map(|b| u64::from(*b))
        .sum();
    sum as f64 / PIXELS as f64
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn a_plugged_in_camera_is_streamed_and_recorded() {
    let Some(library) = replay_library() else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let images = tempfile::tempdir().expect("a folder");
    write_recording(images.path(), IMAGES, ROUNDS, 0);
    let library = library.display();
    let before = format!(
        "LD_LIBRARY_PATH={library} FAKENECT_PATH={}",
        images.path().display()
    );
    let (_process, url) = start(folder.path(), &before, "freenect:A00362A10045");
    let mut client = Client::connect(url).await.expect("connected");
    while camera(&mut client).await.state() != CameraState::Running {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let shown = camera(&mut client).await;
    assert_eq!(shown.source, "freenect:A00362A10045");

    hold(&mut client).await;
    let request = StartRecordingRequest {
        camera: "front".into(),
        consent: true,
    };
    let begun = client.start_recording(request).await.expect("begun");
    let first = camera(&mut client).await.frames;
    while camera(&mut client).await.frames < first + 20 {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let stop = StopRecordingRequest {
        camera: "front".into(),
    };
    let end = client
        .stop_recording(stop)
        .await
        .expect("ended")
        .into_inner();
    assert!(end.frames + end.dropped >= 20, "{end:?}");

    let path = folder.path().join(begun.into_inner().file);
    let mut recording = open_recording(&path).expect("readable");
    let k: &Calibration = recording.calibration();
    assert_eq!(k.color, Some(Intrinsics::KINECT_V1));
    let mut last = None;
    for _ in 0..end.frames {
        let frame = recording.next_frame().expect("whole").expect("a frame");
        let time = Some(frame.time_ns);
        assert!(time > last, "{time:?} after {last:?}");
        last = time;
        let image = image_of(&frame);
        let blue = blue(frame.color.as_ref().expect("colour"));
        assert!(
            (blue - 40.0 - 30.0 * f64::from(image)).abs() < 8.0,
            "image {image}: {blue}"
        );
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn a_service_starts_without_its_camera_and_says_what_is_missing() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_process, url) = start(folder.path(), "", "v4l2:035422073153");
    let mut client = Client::connect(url).await.expect("connected");
    let said = async {
        while !(camera(&mut client).await.detail).contains("v4l2:035422073153: not plugged in") {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    let said = tokio::time::timeout(Duration::from_secs(30), said).await;
    said.expect("said in the camera's detail");
    assert_eq!(camera(&mut client).await.state(), CameraState::Lost);
}
