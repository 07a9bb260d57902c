//! Consent: images are subscribed to under a lease, and by the service alone that has it.

use crate::cameras::Cameras;
use crate::common::{Client, camera, hold, start_with};
use std::time::Duration;
use tryon_formats::open_recording;
use tryon_proto::v1::*;

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn images_are_subscribed_to_only_while_somebody_consents() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(cameras) = Cameras::start(folder.path()) else {
        return;
    };
    let network = format!("capture.ros2.connect={:?}", cameras.network.connect);
    let (_process, url) = start_with(folder.path(), &cameras.source("raw"), &[network]);
    let mut client = Client::connect(url).await.expect("connected");
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

    // Stopped under consent, and started without.
    let request = StopCameraRequest {
        camera: "front".into(),
    };
    client.stop_camera(request).await.expect("stopped");
    cameras.wait_for(&off);
    let request = StartCameraRequest {
        camera: "front".into(),
    };
    client.start_camera(request).await.expect("started");
    while camera(&mut client).await.state() != CameraState::Running {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}
