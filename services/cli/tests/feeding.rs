//! A camera of `tryon up` that another program feeds, as README starts both.
#![allow(missing_docs)]

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use tonic::metadata::{Ascii, MetadataValue};
use tonic::{Code, Request, Status};
use tryon_proto::v1::capture_service_client::CaptureServiceClient;
use tryon_proto::v1::publish_frames_request::Content;
use tryon_proto::v1::*;

const SIDE: u32 = 32;

/// A box that ends with the test.
struct RunningBox(Child);

impl Drop for RunningBox {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A box with one camera that is fed; the address of its capture service, and the token that it prints.
fn up(bus: &str) -> (RunningBox, String, String) {
    let mut c = Command::new(env!("CARGO_BIN_EXE_tryon"));
    c.args(["up", "--set", "identity.off=true"]);
    for service in ["capture", "tracking", "cloth", "compositor"] {
        for key in ["address", "admin"] {
            c.args(["--set", &format!("{service}.{key}=127.0.0.1:0")]);
        }
    }
    let listen = format!("bus.listen=[\"unixsock-stream/{bus}\"]");
    let cameras = "capture.cameras=[{name=\"front\",source=\"push\"}]";
    c.args(["--set", &listen, "--set", cameras]);
    let mut child = c.stdout(Stdio::piped()).spawn().expect("starts");
    let out = child.stdout.take().expect("piped");
    let running = RunningBox(child);
    let (mut address, mut token) = (None, None);
    for line in BufReader::new(out).lines().map_while(Result::ok) {
        if let Some(rest) = line.strip_prefix("capture: grpc ") {
            address = rest.split(' ').next().map(str::to_owned);
        }
        if let Some(rest) = line.strip_prefix("camera front: fed with token ") {
            token = Some(rest.to_owned());
            break;
        }
    }
    let address = format!("http://{}", address.expect("its address"));
    (running, address, token.expect("a token"))
}

fn requests() -> [PublishFramesRequest; 2] {
    let pinhole = Intrinsics {
        width: SIDE,
        height: SIDE,
        fx: 30.0,
        fy: 30.0,
        cx: 15.5,
        cy: 15.5,
    };
    let description = CameraDescription {
        camera: "front".into(),
        depth: Some(Lens {
            intrinsics: Some(pinhole),
            distortion: vec![],
        }),
        depth_unit: 1e-3,
        ..Default::default()
    };
    let frame = CameraFrame {
        number: 1,
        depth: vec![0; 2 * (SIDE * SIDE) as usize].into(),
        ..Default::default()
    };
    [Content::Description(description), Content::Frame(frame)].map(|content| PublishFramesRequest {
        content: Some(content),
    })
}

/// Outcome of the first frame.
async fn feed(address: &str, token: Option<&str>) -> Result<FrameOutcome, Status> {
    let mut client = CaptureServiceClient::connect(address.to_owned())
        .await
        .expect("connected");
    let mut request = Request::new(tokio_stream::iter(requests()));
    if let Some(token) = token {
        let bearer: MetadataValue<Ascii> = format!("Bearer {token}").parse().expect("ASCII");
        request.metadata_mut().insert("authorization", bearer);
    }
    let mut answers = client.publish_frames(request).await?.into_inner();
    let answer = answers.message().await?.expect("an answer");
    Ok(answer.outcome())
}

#[tokio::test]
async fn a_program_feeds_a_camera_of_a_box_with_the_token_that_it_prints() {
    let folder = tempfile::tempdir().expect("a folder");
    let bus = folder.path().join("bus");
    let (_running, address, token) = up(&bus.to_string_lossy());
    let outcome = feed(&address, Some(&token)).await;
    assert_eq!(outcome.expect("taken"), FrameOutcome::Unwatched);
    let refused = feed(&address, None).await.expect_err("no token");
    assert_eq!(refused.code(), Code::Unauthenticated);
}
