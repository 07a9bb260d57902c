//! Bad requests: each names its field, and none disturbs another try-on.

use crate::client;
use crate::kiosk::{Kiosk, Part, Watcher, wear};
use tonic::{Code, Status};
use tonic_types::StatusExt;
use tryon::formats::image::decode_jpeg;
use tryon_proto::v1::capture_service_client::CaptureServiceClient;
use tryon_proto::v1::*;

/// Path of the field at fault.
pub fn field(s: Status) -> String {
    assert_eq!(s.code(), Code::InvalidArgument, "{s}");
    let details = s.get_error_details();
    let bad = details.bad_request().expect("BadRequest");
    bad.field_violations[0].field.clone()
}

#[test]
fn bad_requests_name_their_fields_and_disturb_nobody() {
    let kiosk = Kiosk::start("pattern", 10.0);
    client(async {
        let mut w = Watcher::open(&kiosk, "good", "front", &[]).await;
        w.picture(TryOnState::Degraded).await;
        bad_compositor_requests(&kiosk).await;
        bad_capture_requests(&kiosk).await;
        huge_length_prefix(kiosk.config.compositor.address).await;
        w.picture(TryOnState::Degraded).await;
    });
}

async fn bad_compositor_requests(kiosk: &Kiosk) {
    let mut c = kiosk.compositor();
    let open = |camera: &str, garments| OpenTryOnRequest {
        try_on_id: "bad".into(),
        store: String::new(),
        camera: camera.into(),
        garments,
        consent: Some(Consent { given: true }),
    };
    let wildcard = c.open_try_on(open("*", vec![])).await;
    let named = field(wildcard.expect_err("a wildcard"));
    assert_eq!(named, "open_try_on_request.camera");
    let cape = c.open_try_on(open("front", wear(&["cape"]))).await;
    let named = field(cape.expect_err("no cape"));
    assert_eq!(named, "open_try_on_request.garments[0].garment");

    let mut garments = wear(&["tshirt"]);
    garments[0].size = "XXXXXL".into();
    let huge = ChooseGarmentsRequest {
        try_on_id: "good".into(),
        garments,
    };
    let named = field(c.choose_garments(huge).await.expect_err("no such size"));
    assert_eq!(named, "choose_garments_request.garments[0].size");

    let small = StreamFramesRequest {
        width: 5,
        height: 5,
        ..Default::default()
    };
    let named = field(c.stream_frames(small).await.expect_err("too small"));
    assert_eq!(named, "stream_frames_request.width");
    let odd = StreamFramesRequest {
        framing: 9,
        ..Default::default()
    };
    let named = field(c.stream_frames(odd).await.expect_err("no such framing"));
    assert_eq!(named, "stream_frames_request.framing");
    let unknown = StreamFramesRequest {
        try_on_id: "nobody".into(),
        ..Default::default()
    };
    let unknown = c.stream_frames(unknown).await.expect_err("unknown");
    assert_eq!(unknown.code(), Code::NotFound);
}

#[test]
fn a_reader_that_acknowledges_gets_the_next_picture_when_it_has_room() {
    let kiosk = Kiosk::start("pattern", 10.0);
    client(async {
        let mut other = Watcher::open(&kiosk, "good", "front", &[]).await;
        let mut c = kiosk.compositor();
        let wide = StreamFramesRequest {
            try_on_id: "good".into(),
            max_unacknowledged: 17,
            ..Default::default()
        };
        let named = field(c.stream_frames(wide).await.expect_err("too many"));
        assert_eq!(named, "stream_frames_request.max_unacknowledged");
        let one = StreamFramesRequest {
            try_on_id: "good".into(),
            max_unacknowledged: 1,
            ..Default::default()
        };
        let mut events = c.stream_frames(one).await.expect("streams").into_inner();
        let mut pictures = Vec::new();
        for number in 1.. {
            let message = events.message().await.expect("no fault").expect("no end");
            assert_eq!(message.number, number, "one at a time");
            if let Some(stream_frames_response::Event::Picture(p)) = message.event {
                pictures.push(p);
            }
            if pictures.len() == 2 {
                break;
            }
            for _ in 0..5 {
                other.picture(TryOnState::Degraded).await;
            }
            let acknowledgement = AcknowledgeFramesRequest {
                try_on_id: "good".into(),
                stream: message.stream,
                number,
            };
            let stray = AcknowledgeFramesRequest {
                stream: message.stream ^ 1,
                ..acknowledgement.clone()
            };
            c.acknowledge_frames(stray).await.expect("no error");
            c.acknowledge_frames(acknowledgement).await.expect("taken");
        }
        let [first, second] = [0, 1].map(|i| &pictures[i]);
        let sequence = |p: &Picture| p.frame.expect("an exposure").sequence;
        assert!(second.dropped >= first.dropped + 4, "{}", second.dropped);
        assert!(sequence(second) > sequence(first) + 4, "it is a new one");
    });
}

/// Upright pictures of a camera that lies: filled to the corners, or black above and below.
#[test]
fn pictures_of_another_shape_are_filled_or_letterboxed() {
    let kiosk = Kiosk::start("pattern", 10.0);
    client(async {
        let _open = Watcher::open(&kiosk, "good", "front", &[]).await;
        for (framing, is_black) in [
            (PictureFraming::Unspecified, true),
            (PictureFraming::Contain, true),
            (PictureFraming::Cover, false),
        ] {
            let upright = StreamFramesRequest {
                try_on_id: "good".into(),
                width: 180,
                height: 320,
                framing: framing.into(),
                ..Default::default()
            };
            let mut c = kiosk.compositor();
            let mut events = c
                .stream_frames(upright)
                .await
                .expect("streams")
                .into_inner();
            let picture = loop {
                let message = events.message().await.expect("no fault").expect("no end");
                if let Some(stream_frames_response::Event::Picture(p)) = message.event {
                    break p;
                }
            };
            assert_eq!((picture.width, picture.height), (180, 320));
            let image = decode_jpeg(&picture.image).expect("a JPEG");
            let corners = [(3, 3), (176, 3), (3, 316), (176, 316)];
            for (u, v) in corners {
                let is_dark = image.at(u, v).iter().all(|c| *c < 8);
                assert_eq!(is_dark, is_black, "{framing:?} {u} {v}");
            }
        }
    });
}

#[test]
fn one_format_too_many_is_refused_and_the_others_go_on() {
    let kiosk = Kiosk::start("pattern", 10.0);
    client(async {
        let mut w = Watcher::open(&kiosk, "good", "front", &[]).await;
        let mut c = kiosk.compositor();
        let most = kiosk.config.compositor.max_formats as u32;
        let mut open = Vec::new();
        for i in 1..=most {
            let sized = StreamFramesRequest {
                try_on_id: "good".into(),
                width: 320 + 16 * i,
                height: 240,
                ..Default::default()
            };
            open.push(c.stream_frames(sized).await);
        }
        let last = open.pop().expect("several").expect_err("too many");
        assert_eq!(last.code(), Code::ResourceExhausted);
        assert!(last.get_error_details().retry_info().is_some());
        assert!(open.iter().all(Result::is_ok));
        w.picture(TryOnState::Degraded).await;
    });
}

async fn bad_capture_requests(kiosk: &Kiosk) {
    let mut capture = CaptureServiceClient::new(kiosk.channel(Part::Capture));
    let camera = "front".to_owned();
    let without_consent = StartRecordingRequest {
        camera: camera.clone(),
        consent: false,
    };
    let e = capture.start_recording(without_consent).await;
    assert_eq!(e.expect_err("no consent").code(), Code::FailedPrecondition);
    let e = capture.start_camera(StartCameraRequest { camera }).await;
    assert_eq!(e.expect_err("it runs").code(), Code::FailedPrecondition);
}

/// A gRPC message that announces 4 GiB: an error, no allocation, and the server lives.
async fn huge_length_prefix(address: std::net::SocketAddr) {
    use std::io::{Read, Write};
    let mut s = std::net::TcpStream::connect(address).expect("connects");
    let body = [0u8, 0xff, 0xff, 0xff, 0xff, 1, 2, 3];
    let head = "POST /tryon.v1.CompositorService/OpenTryOn HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
                Content-Type: application/grpc-web+proto\r\nContent-Length: 8\r\n\r\n";
    s.write_all(head.as_bytes())
        .and_then(|()| s.write_all(&body))
        .expect("sends");
    let mut out = Vec::new();
    s.read_to_end(&mut out).expect("answers");
    let text = String::from_utf8_lossy(&out).to_lowercase();
    let status = text
        .split("grpc-status:")
        .nth(1)
        .and_then(|t| t.trim().chars().next());
    assert!(status.is_some_and(|c| c != '0'), "{text}");
}
