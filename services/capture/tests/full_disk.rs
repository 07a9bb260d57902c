//! A disk that becomes full under a recording: the error is typed, publishing goes on, the file is readable.

mod common;

use common::{Client, camera, hold, start};
use std::time::Duration;
use tonic::Code;
use tryon_formats::open_recording;
use tryon_proto::v1::{StartRecordingRequest, StopRecordingRequest};

/// Files of at most 300 KiB (RLIMIT_FSIZE, EFBIG like a full disk's ENOSPC).
const FULL_DISK: &str = "trap '' XFSZ; ulimit -f 600;";

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn a_full_disk_ends_the_recording_and_nothing_else() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_process, url) = start(folder.path(), FULL_DISK, "pattern");
    let mut client = Client::connect(url).await.expect("connected");
    let request = StartRecordingRequest {
        camera: "front".into(),
        consent: true,
    };
    hold(&mut client).await;
    let begun = client.start_recording(request).await.expect("begun");
    let file = begun.into_inner().file;

    while camera(&mut client).await.recording {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    let before = camera(&mut client).await.frames;
    while camera(&mut client).await.frames < before + 10 {
        hold(&mut client).await;
        tokio::time::sleep(Duration::from_millis(50)).await;
    }

    let request = StopRecordingRequest {
        camera: "front".into(),
    };
    let fault = client.stop_recording(request.clone()).await;
    let fault = fault.expect_err("the disk is full");
    assert_eq!(fault.code(), Code::ResourceExhausted, "{fault}");
    assert!(fault.message().contains(&file), "{fault}");
    let again = client.stop_recording(request).await.expect_err("ended");
    assert_eq!(again.code(), Code::FailedPrecondition);

    let mut recording = open_recording(&folder.path().join(file)).expect("readable");
    let mut frames = 0;
    while recording.next_frame().expect("whole frames").is_some() {
        frames += 1;
    }
    assert!(frames > 0);
}
