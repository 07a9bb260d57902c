//! Consent as clients meet it: nothing without it, nothing after it, and a photo that is fetched once.

use crate::client;
use crate::kiosk::{Kiosk, Part, Watcher};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;
use tonic::{Code, Request};
use tryon_proto::v1::capture_service_client::CaptureServiceClient;
use tryon_proto::v1::stream_frames_response::Event;
use tryon_proto::v1::*;

/// Time in which a camera that runs publishes several frames.
const SEVERAL_FRAMES: Duration = Duration::from_millis(700);
/// Time after which a lease that nobody renews has ended.
const LEASE_OVER: Duration = Duration::from_secs(3);

/// Frames that the cameras publish in a while.
async fn frames_in_a_while(kiosk: &Kiosk) -> u64 {
    let mut capture = CaptureServiceClient::new(kiosk.channel(Part::Capture));
    let mut published = async || {
        let cameras = capture.list_cameras(ListCamerasRequest {}).await;
        let cameras = cameras.expect("listed").into_inner().cameras;
        cameras.iter().map(|c| c.frames).sum::<u64>()
    };
    let before = published().await;
    tokio::time::sleep(SEVERAL_FRAMES).await;
    published().await - before
}

#[test]
fn nothing_is_published_without_consent_nor_after_it() {
    let mut kiosk = Kiosk::start("pattern", 20.0);
    client(async {
        assert_eq!(frames_in_a_while(&kiosk).await, 0, "before anybody agreed");
        let mut c = kiosk.compositor();
        let open = |camera: &str, given| OpenTryOnRequest {
            try_on_id: "a".into(),
            camera: camera.into(),
            consent: Some(Consent { given }),
            ..Default::default()
        };
        let refused = c.open_try_on(open("front", false)).await;
        let code = refused.expect_err("no consent").code();
        assert_eq!(code, Code::FailedPrecondition);
        let unknown = c.open_try_on(open("nowhere", true)).await;
        assert_eq!(unknown.expect_err("no camera").code(), Code::NotFound);

        let mut w = Watcher::open(&kiosk, "a", "front", &[]).await;
        w.picture(TryOnState::Degraded).await;
        assert!(frames_in_a_while(&kiosk).await > 0);
        let withdraw = WithdrawConsentRequest {
            try_on_id: "a".into(),
        };
        c.withdraw_consent(withdraw).await.expect("withdrawn");
        assert_eq!(frames_in_a_while(&kiosk).await, 0, "after the withdrawal");
        let mut end = TryOnEnd::Unspecified;
        let status = loop {
            match w.next().await {
                Ok(Event::Status(s)) => end = s.end(),
                Ok(Event::Picture(_)) => {}
                Err(s) => break s,
            }
        };
        assert_eq!((end, status.code()), (TryOnEnd::Withdrawn, Code::Ok));

        let mut again = Watcher::open(&kiosk, "a", "front", &[]).await;
        again.picture(TryOnState::Degraded).await;
        kiosk.kill(Part::Compositor);
        tokio::time::sleep(LEASE_OVER).await;
        assert_eq!(
            frames_in_a_while(&kiosk).await,
            0,
            "after a lost compositor"
        );
    });
}

#[test]
fn a_photo_is_fetched_once_and_ends_with_its_try_on() {
    let kiosk = Kiosk::start("pattern", 20.0);
    client(async {
        let mut w = Watcher::open(&kiosk, "a", "front", &[]).await;
        w.picture(TryOnState::Degraded).await;
        let address = kiosk.config.compositor.address;
        let mut c = kiosk.compositor();
        let mut offer = async || {
            let mut request = Request::new(OfferPhotoRequest {
                try_on_id: "a".into(),
            });
            // As a page of this port sends it.
            let origin = format!("http://{address}").parse().expect("ASCII");
            request.metadata_mut().insert("origin", origin);
            c.offer_photo(request).await.expect("offered").into_inner()
        };
        let photo = offer().await;
        assert!(photo.qr_svg.contains("<svg"), "{}", photo.qr_svg);
        let path = photo.url.strip_prefix(&format!("http://{address}"));
        let path = path.expect("the origin that was asked by");
        let answer = get(address, path);
        let image = photo.picture.expect("a picture").image;
        assert!(answer.ends_with(&image) && answer.starts_with(b"HTTP/1.1 200"));
        assert!(get(address, path).starts_with(b"HTTP/1.1 404"), "once");

        let late = offer().await.url;
        let path = late.split_once("/photo/").expect("a link").1;
        let close = CloseTryOnRequest {
            try_on_id: "a".into(),
        };
        kiosk
            .compositor()
            .close_try_on(close)
            .await
            .expect("closed");
        while w.next().await.is_ok() {}
        tokio::time::sleep(SEVERAL_FRAMES).await;
        let answer = get(address, &format!("/photo/{path}"));
        assert!(answer.starts_with(b"HTTP/1.1 404"), "its try-on is over");
    });
}

/// Answer of a port to an HTTP request.
pub fn get(address: SocketAddr, path: &str) -> Vec<u8> {
    let mut s = TcpStream::connect(address).expect("connects");
    let head = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
    s.write_all(head.as_bytes()).expect("sends");
    let mut answer = Vec::new();
    s.read_to_end(&mut answer).expect("answers");
    answer
}
