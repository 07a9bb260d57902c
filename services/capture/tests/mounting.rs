//! A camera that hangs turned: the service publishes and records upright pictures.

mod common;

use common::{Client, camera, hold, start, start_camera};
use std::time::Duration;
use tryon_formats::open_recording;
use tryon_geometry::camera::{DepthImage, RgbdFrame};
use tryon_proto::v1::{
    GetCalibrationRequest, Intrinsics, StartRecordingRequest, StopRecordingRequest,
};
use tryon_synth::{Actor, Routine, Sequence, Setting};

async fn depth_camera(client: &mut Client) -> Intrinsics {
    let request = GetCalibrationRequest {
        camera: "front".into(),
    };
    let answer = client.get_calibration(request).await.expect("answered");
    let calibration = answer.into_inner().calibration.expect("a calibration");
    calibration.depth.expect("a depth camera")
}

/// Frames that the camera records within some ten of them.
async fn recorded(client: &mut Client, folder: &std::path::Path) -> Vec<RgbdFrame> {
    hold(client).await;
    let request = StartRecordingRequest {
        camera: "front".into(),
        consent: true,
    };
    let begun = client.start_recording(request).await.expect("begun");
    let before = camera(client).await.frames;
    while camera(client).await.frames < before + 10 {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let stop = StopRecordingRequest {
        camera: "front".into(),
    };
    client.stop_recording(stop).await.expect("ended");
    let path = folder.join(begun.into_inner().file);
    let mut recording = open_recording(&path).expect("readable");
    std::iter::from_fn(|| recording.next_frame().expect("whole")).collect()
}

/// A picture turned clockwise by a quarter, pixel by pixel.
fn turned(image: &DepthImage) -> DepthImage {
    let (w, h) = (image.width() as i32, image.height() as i32);
    let pixels = (0..w).flat_map(|v| (0..h).map(move |u| image.at(v, h - 1 - u)));
    DepthImage::new(image.height(), image.width(), pixels.collect()).expect("as many")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn turned_cameras_publish_upright_pictures() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_process, url) = start_camera(folder.path(), "source=\"synth:still\",turned=90");
    let mut client = Client::connect(url).await.expect("connected");
    let k = depth_camera(&mut client).await;
    assert_eq!((k.width, k.height), (480, 640));
    assert_eq!((k.cx, k.cy), (479.0 - 239.5, 319.5));

    let frames = recorded(&mut client, folder.path()).await;
    let first = frames.first().expect("frames");
    let setting = Setting {
        routine: Routine::Still,
        ..Setting::default()
    };
    // The noise of a frame tells its number.
    let sequence = Sequence::new(Actor::default(), setting);
    let is_first = |i: &u64| turned(&sequence.frame(*i).0.depth) == first.depth;
    let number = (0..300).find(is_first);
    assert!(number.is_some(), "no frame of the source, turned");
    let color = first.color.as_ref().expect("colour");
    assert_eq!((color.width(), color.height()), (480, 640));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn upright_cameras_are_not_turned() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_process, url) = start(folder.path(), "", "synth:still");
    let mut client = Client::connect(url).await.expect("connected");
    let k = depth_camera(&mut client).await;
    assert_eq!((k.width, k.height), (640, 480));
}
