//! A camera that another program feeds.

mod common;

use common::{Client, camera, hold, start};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Status, Streaming};
use tryon_formats::open_recording;
use tryon_proto::v1::publish_frames_request::Content;
use tryon_proto::v1::*;

const SIZE: [u32; 2] = [32, 24];
/// Half a millimetre.
const UNIT: f64 = 5e-4;

fn described() -> CameraDescription {
    let [width, height] = SIZE;
    let pinhole = Intrinsics {
        width,
        height,
        fx: 30.0,
        fy: 30.0,
        cx: 15.5,
        cy: 11.5,
    };
    CameraDescription {
        camera: "front".into(),
        depth: Some(Lens {
            intrinsics: Some(pinhole),
            distortion: vec![],
        }),
        depth_unit: UNIT,
        device: "Stand-in 42".into(),
        ..Default::default()
    }
}

/// Depth that grows from pixel to pixel, and colours in the order of the encoding's bytes.
fn frame(number: u64) -> CameraFrame {
    let pixels = SIZE[0] * SIZE[1];
    CameraFrame {
        number,
        capture_time_ns: 1_000_000_000 + number * 33_333_333,
        depth: (0..pixels)
            .flat_map(|i| (2000 + 2 * i as u16).to_le_bytes())
            .collect::<Vec<u8>>()
            .into(),
        color: [10u8, 20, 30].repeat(pixels as usize).into(),
        color_encoding: ColorEncoding::Bgr8.into(),
        color_time_ns: 0,
    }
}

/// A sender of frames.
struct Sender {
    requests: mpsc::Sender<PublishFramesRequest>,
    answers: Streaming<PublishFramesResponse>,
}

impl Sender {
    async fn open(client: &mut Client, description: CameraDescription) -> Result<Self, Status> {
        let (requests, stream) = mpsc::channel(8);
        let content = Some(Content::Description(description));
        requests
            .send(PublishFramesRequest { content })
            .await
            .expect("open");
        let answers = client.publish_frames(ReceiverStream::new(stream)).await?;
        Ok(Self {
            requests,
            answers: answers.into_inner(),
        })
    }

    async fn send(&mut self, frame: CameraFrame) -> Result<PublishFramesResponse, Status> {
        let content = Some(Content::Frame(frame));
        // Fails when the call has ended, and then its answers say why.
        let _ = self.requests.send(PublishFramesRequest { content }).await;
        self.answers.message().await.map(|m| m.expect("an answer"))
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn frames_arrive_as_they_were_sent_and_only_while_somebody_may_see_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_process, url) = start(folder.path(), "", "push");
    let mut client = Client::connect(url).await.expect("connected");
    assert_eq!(camera(&mut client).await.state(), CameraState::Stopped);

    let mut sender = Sender::open(&mut client, described()).await.expect("open");
    let answer = sender.send(frame(1)).await.expect("answered");
    assert_eq!(
        (answer.number, answer.outcome()),
        (1, FrameOutcome::Unwatched)
    );

    hold(&mut client).await;
    let answer = sender.send(frame(2)).await.expect("answered");
    assert_eq!((answer.number, answer.outcome()), (2, FrameOutcome::Taken));
    // Taken, it is still on its way to where a recording would begin.
    while camera(&mut client).await.frames < 1 {
        tokio::task::yield_now().await;
    }

    let request = StartRecordingRequest {
        camera: "front".into(),
        consent: true,
    };
    let begun = client.start_recording(request).await.expect("begun");
    for number in 3..8 {
        let answer = sender.send(frame(number)).await.expect("answered");
        assert_eq!(answer.outcome(), FrameOutcome::Taken);
    }
    let mut broken = frame(8);
    broken.color_encoding = ColorEncoding::Jpeg.into();
    let answer = sender.send(broken).await.expect("answered");
    assert_eq!(answer.outcome(), FrameOutcome::Refused);
    assert!(answer.detail.contains("push/front"), "{}", answer.detail);
    let shown = camera(&mut client).await;
    assert_eq!(
        (shown.source.as_str(), shown.state()),
        ("push: Stand-in 42", CameraState::Running)
    );
    let stop = StopRecordingRequest {
        camera: "front".into(),
    };
    let end = client
        .stop_recording(stop)
        .await
        .expect("ended")
        .into_inner();
    assert_eq!((end.frames, end.dropped), (5, 0));

    let Sender {
        requests,
        mut answers,
    } = sender;
    drop(requests);
    assert!(
        answers.message().await.expect("no fault").is_none(),
        "the call ends"
    );

    let path = folder.path().join(begun.into_inner().file);
    let mut recording = open_recording(&path).expect("readable");
    let first = recording.next_frame().expect("whole").expect("a frame");
    assert_eq!(
        first.time_ns,
        frame(3).capture_time_ns,
        "the camera's clock"
    );
    assert_eq!(first.depth.at(0, 0), 1000, "2000 halves of a millimetre");
    assert_eq!(first.depth.at(5, 2), 1000 + 2 * 32 + 5);
    let [r, g, b] = first.color.expect("colour").at(3, 3).map(i32::from);
    assert!(
        (r - 30).abs() < 4 && (g - 20).abs() < 4 && (b - 10).abs() < 4,
        "{r} {g} {b}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn the_newest_sender_feeds_and_faults_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_process, url) = start(folder.path(), "", "push");
    let mut client = Client::connect(url).await.expect("connected");
    hold(&mut client).await;
    let refused = async |client: &mut Client, change: fn(&mut CameraDescription)| {
        let mut d = described();
        change(&mut d);
        Sender::open(client, d).await.err().expect("refused")
    };
    let e = refused(&mut client, |d| d.depth_unit = 1000.0).await;
    assert!(e.message().contains("description.depth_unit"), "{e}");
    let e = refused(&mut client, |d| d.depth = None).await;
    assert!(e.message().contains("description.depth"), "{e}");
    let e = refused(&mut client, |d| d.camera = "side".into()).await;
    assert_eq!(e.code(), Code::NotFound);

    let mut first = Sender::open(&mut client, described()).await.expect("open");
    first.send(frame(1)).await.expect("answered");
    let epoch = camera(&mut client).await.epoch;
    let mut second = Sender::open(&mut client, described()).await.expect("open");
    second.send(frame(1)).await.expect("answered");
    assert_ne!(camera(&mut client).await.epoch, epoch);
    let gone = first.send(frame(2)).await.expect_err("another feeds it");
    assert_eq!(gone.code(), Code::Aborted);

    let mut short = frame(2);
    short.depth = short.depth.slice(..100);
    let e = second.send(short).await.expect_err("too short");
    assert_eq!(e.code(), Code::InvalidArgument);
    assert!(e.message().contains("frame.depth"), "{e}");
    while camera(&mut client).await.state() != CameraState::Ended {
        tokio::time::sleep(std::time::Duration::from_millis(20)).await;
    }
    let mut third = Sender::open(&mut client, described()).await.expect("open");
    assert!(third.send(frame(1)).await.is_ok());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn a_camera_with_a_source_of_its_own_is_not_fed() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_process, url) = start(folder.path(), "", "pattern");
    let mut client = Client::connect(url).await.expect("connected");
    let e = Sender::open(&mut client, described()).await.err();
    assert_eq!(e.expect("refused").code(), Code::FailedPrecondition);
}
