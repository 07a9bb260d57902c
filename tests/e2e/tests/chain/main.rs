//! The whole chain, judged from outside: what a client sees, and when.
#![allow(
    clippy::unwrap_used,
    missing_docs,
    unreachable_pub,
    clippy::print_stdout
)]

mod kiosk;
mod simulation;

use kiosk::{Kiosk, PARTS, Part, Watcher, wear};
use std::time::{Duration, Instant};
use tonic::Code;
use tonic_types::StatusExt;
use tryon_kit::server::Outcome;
use tryon_proto::v1::capture_service_client::CaptureServiceClient;
use tryon_proto::v1::stream_frames_response::Event;
use tryon_proto::v1::*;

/// Share of a JPEG's pixels that are clearly green, blue or red.
fn colored(jpeg: &[u8]) -> f64 {
    let image = tryon::formats::image::decode_jpeg(jpeg).expect("a picture");
    let strong = |p: &&[u8]| {
        p.iter()
            .max()
            .zip(p.iter().min())
            .is_some_and(|(a, b)| a - b > 40)
    };
    image.data().chunks_exact(3).filter(strong).count() as f64 / (image.data().len() / 3) as f64
}

fn client<T>(f: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .expect("a runtime")
        .block_on(f)
}

/// A garment made as a mesh: a hoop skirt, as its OBJ.
fn hoop_skirt() -> String {
    let (rings, around) = (12u32, 36u32);
    let mut text = String::new();
    for k in 0..=rings {
        let t = f64::from(k) / f64::from(rings);
        let (y, r) = (0.55 + 0.45 * t, 0.24 - 0.04 * t);
        for j in 0..around {
            let t = std::f64::consts::TAU * f64::from(j) / f64::from(around);
            text.push_str(&format!("v {} {y} {}\n", r * t.cos(), -r * t.sin()));
        }
    }
    for k in 0..rings {
        for j in 0..around {
            let (a, b) = (k * around + j + 1, k * around + (j + 1) % around + 1);
            text.push_str(&format!(
                "f {a} {b} {}\nf {b} {} {}\n",
                a + around,
                b + around,
                a + around
            ));
        }
    }
    text
}

#[test]
fn health_reflection_a_hundred_frames_another_garment_and_the_end() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("hoop.obj"), hoop_skirt()).expect("written");
    std::fs::write(
        folder.path().join("torn.obj"),
        hoop_skirt() + "f 1 2 99999\n",
    )
    .expect("written");
    let kiosk = Kiosk::with("synth:still", 10.0, |c| {
        c.cloth.garments = folder.path().to_owned()
    });
    client(async {
        for part in PARTS {
            let mut health =
                tonic_health::pb::health_client::HealthClient::new(kiosk.channel(part));
            let service = format!("tryon.v1.{part:?}Service");
            let r = health
                .check(tonic_health::pb::HealthCheckRequest { service })
                .await
                .expect("health");
            assert_eq!(
                r.into_inner().status(),
                tonic_health::pb::health_check_response::ServingStatus::Serving
            );
            assert!(
                http(kiosk.admin(part), "/readyz").starts_with("HTTP/1.1 200"),
                "{part:?}"
            );
            assert!(
                http(kiosk.admin(part), "/metrics").starts_with("HTTP/1.1 200"),
                "{part:?}"
            );
        }
        assert!(
            reflected(&kiosk)
                .await
                .contains(&"tryon.v1.CompositorService".to_owned())
        );
        assert!(
            http(kiosk.config.compositor.address, "/").contains("<html"),
            "the page"
        );

        let mut w = Watcher::open(&kiosk, "first", "front", &["tshirt"]).await;
        assert!(
            matches!(w.next().await, Ok(Event::Status(_))),
            "the first message is a status"
        );
        let p = w.picture(TryOnState::Live).await;
        assert_eq!((p.width, p.height, p.outfit_revision), (320, 240, 1));
        assert_eq!(&p.image[..2], &[0xff, 0xd8], "a JPEG");
        for stage in [
            "capture.encode",
            "tracking.total",
            "cloth.step",
            "compositor.render",
            "compositor.encode",
        ] {
            assert!(
                p.stages.iter().any(|s| s.stage == stage),
                "{stage} is missing in {:?}",
                p.stages
            );
        }
        let (mut last, begun) = (p.frame.expect("an id"), Instant::now());
        let mut fit = Vec::new();
        for _ in 0..99 {
            let e = w
                .until("a picture", |e| matches!(e, Event::Picture(_)))
                .await;
            let Event::Picture(p) = e else {
                unreachable!("just matched")
            };
            let id = p.frame.expect("an id");
            assert!(
                id.epoch == last.epoch && id.sequence > last.sequence,
                "in order, none twice"
            );
            last = id;
            fit = p.fit;
        }
        let chest = fit
            .first()
            .and_then(|f| f.regions.iter().find(|r| r.region == "chest"))
            .expect("fit at the chest");
        assert!(
            fit.len() == 1 && fit[0].garment == "tshirt" && chest.fit() != FitClass::Unspecified,
            "{fit:?}"
        );
        // In centimetres too: a T-shirt in M has room to spare on this shopper, and says where it ends.
        let ease =
            chest.ease.expect("room at the chest") - chest.ease_needed.expect("what it needs");
        let hem = fit[0].hem_above.expect("a hem");
        assert!(
            ease.abs() < 0.3 && hem.abs() < 0.4 && fit[0].hem_mark == "the crotch",
            "{ease} {hem} {fit:?}"
        );
        println!(
            "the shirt has {:.1} cm to spare at the chest and ends {:.1} cm above the crotch",
            ease * 1e2,
            hem * 1e2
        );
        println!(
            "100 pictures, {:.1} a second",
            99.0 / begun.elapsed().as_secs_f64()
        );

        let mut c = kiosk.compositor();
        let before = colored(&p.image);
        let show = ShowFitRequest {
            try_on_id: "first".into(),
            show: true,
        };
        c.show_fit(show).await.expect("shown");
        let is = |e: &Event| matches!(e, Event::Picture(p) if colored(&p.image) > before + 0.02);
        w.until("the fit in colours", is).await;
        let gone = ShowFitRequest {
            try_on_id: "nobody".into(),
            show: true,
        };
        assert_eq!(
            c.show_fit(gone).await.expect_err("unknown").code(),
            Code::NotFound
        );
        c.show_fit(ShowFitRequest {
            try_on_id: "first".into(),
            show: false,
        })
        .await
        .expect("hidden");

        let choose = ChooseGarmentsRequest {
            try_on_id: "first".into(),
            garments: wear(&["skirt", "longsleeve"]),
        };
        let revision = c
            .choose_garments(choose)
            .await
            .expect("chosen")
            .into_inner()
            .outfit_revision;
        assert_eq!(revision, 2);
        let begun = Instant::now();
        let is = |e: &Event| matches!(e, Event::Picture(p) if p.outfit_revision == 2 && p.state() == TryOnState::Live);
        let Event::Picture(p) = w.until("the other outfit", is).await else {
            unreachable!("just matched")
        };
        assert!(
            p.fit.iter().all(|f| f.garment != "tshirt"),
            "the fit of what is not worn: {:?}",
            p.fit
        );
        println!(
            "another outfit after {:.2} s",
            begun.elapsed().as_secs_f64()
        );

        // A mesh from the folder; the torn one beside it is not offered.
        let offered = c
            .list_garment_choices(ListGarmentChoicesRequest {})
            .await
            .expect("listed")
            .into_inner()
            .garments;
        let hoop = offered.iter().find(|g| g.name == "hoop").expect("offered");
        assert!(
            hoop.sizes.is_empty() && offered.iter().all(|g| g.name != "torn"),
            "{offered:?}"
        );
        let mesh = vec![GarmentChoice {
            garment: "hoop".into(),
            ..Default::default()
        }];
        let choose = ChooseGarmentsRequest {
            try_on_id: "first".into(),
            garments: mesh,
        };
        c.choose_garments(choose).await.expect("chosen");
        let is = |e: &Event| matches!(e, Event::Picture(p) if p.outfit_revision == 3 && !p.fit.is_empty());
        let Event::Picture(p) = w.until("the mesh is worn", is).await else {
            unreachable!("just matched")
        };
        assert!(
            p.fit
                .iter()
                .all(|f| f.garment == "hoop" && f.hem_above.is_none()),
            "{:?}",
            p.fit
        );
        let snap = TakeSnapshotRequest {
            try_on_id: "first".into(),
            codec: 0,
        };
        let snap = c
            .take_snapshot(snap)
            .await
            .expect("a snapshot")
            .into_inner()
            .picture
            .expect("a picture");
        assert_eq!((&snap.image[1..4], snap.width), (&b"PNG"[..], 640));

        c.close_try_on(CloseTryOnRequest {
            try_on_id: "first".into(),
        })
        .await
        .expect("closed");
        let mut closed = false;
        let end = loop {
            match w.next().await {
                Ok(Event::Status(s)) => closed = s.state() == TryOnState::Closed,
                Ok(Event::Picture(_)) => {}
                Err(s) => break s,
            }
        };
        assert!(
            closed && end.code() == Code::Ok,
            "the last message says CLOSED, the end is OK: {end}"
        );
    });
}

fn http(address: std::net::SocketAddr, path: &str) -> String {
    use std::io::{Read, Write};
    let mut s = std::net::TcpStream::connect(address).expect("connects");
    write!(
        s,
        "GET {path} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"
    )
    .expect("sends");
    let mut out = String::new();
    s.read_to_string(&mut out).expect("answers");
    out
}

async fn reflected(kiosk: &Kiosk) -> Vec<String> {
    use tonic_reflection::pb::v1::server_reflection_request::MessageRequest;
    use tonic_reflection::pb::v1::server_reflection_response::MessageResponse;
    use tonic_reflection::pb::v1::{
        ServerReflectionRequest, server_reflection_client::ServerReflectionClient,
    };
    let list = Some(MessageRequest::ListServices(String::new()));
    let r = ServerReflectionRequest {
        host: String::new(),
        message_request: list,
    };
    let mut c = ServerReflectionClient::new(kiosk.channel(Part::Compositor));
    let mut answers = c
        .server_reflection_info(tokio_stream::once(r))
        .await
        .expect("reflection")
        .into_inner();
    match answers
        .message()
        .await
        .expect("fine")
        .expect("an answer")
        .message_response
    {
        Some(MessageResponse::ListServicesResponse(l)) => {
            l.service.into_iter().map(|s| s.name).collect()
        }
        other => panic!("{other:?}"),
    }
}

/// A client must know of a killed service within this.
const TOLD: Duration = Duration::from_secs(1);
/// And have pictures again this soon after its restart.
const BACK: Duration = Duration::from_secs(5);

#[test]
fn any_service_killed_is_told_within_a_second_and_back_within_five() {
    // Nobody in view: the try-on is Degraded(NO_PERSON) while all is well, and pictures are plain.
    let mut kiosk = Kiosk::start("pattern", 10.0);
    client(async {
        let mut w = Watcher::open(&kiosk, "a", "front", &["tshirt"]).await;
        let mut other = Watcher::open(&kiosk, "b", "side", &[]).await;
        w.degraded(DegradedReason::NoPerson).await;
        w.picture(TryOnState::Degraded).await;
        for part in PARTS {
            let begun = Instant::now();
            kiosk.kill(part);
            let reason = match part {
                Part::Capture => DegradedReason::CameraSilent,
                Part::Tracking => DegradedReason::TrackingUnavailable,
                Part::Cloth => DegradedReason::ClothUnavailable,
                Part::Compositor => DegradedReason::Unspecified,
            };
            if part == Part::Compositor {
                let status = loop {
                    match w.next().await {
                        Ok(_) => {}
                        Err(s) => break s,
                    }
                };
                // A connection that breaks off is UNAVAILABLE, or UNKNOWN with h2's own words, but never OK.
                assert_ne!(status.code(), Code::Ok, "{status}");
            } else if part == Part::Cloth {
                // With nobody in view that is the graver fault: cloth's is not shown, and nothing else may change.
                w.picture(TryOnState::Degraded).await;
            } else {
                w.degraded(reason).await;
            }
            let told = begun.elapsed();
            kiosk.restart(part);
            let begun = Instant::now();
            if part == Part::Compositor {
                w = Watcher::open(&kiosk, "a", "front", &["tshirt"]).await;
                other = Watcher::open(&kiosk, "b", "side", &[]).await;
            }
            w.until(
                "a picture as before",
                |e| matches!(e, Event::Picture(p) if p.reason() == DegradedReason::NoPerson),
            )
            .await;
            let back = begun.elapsed();
            println!("{part:?}: told after {told:.2?}, pictures {back:.2?} after the restart");
            assert!(
                told < TOLD && back < BACK,
                "{part:?}: told after {told:?}, back after {back:?}"
            );
            other.picture(TryOnState::Degraded).await;
        }
    });
}

#[test]
fn a_killed_cloth_or_tracking_degrades_a_live_mirror_and_it_comes_back() {
    let mut kiosk = Kiosk::start("synth:still", 10.0);
    client(async {
        let mut w = Watcher::open(&kiosk, "live", "front", &["tshirt"]).await;
        w.picture(TryOnState::Live).await;
        for (part, reason) in [
            (Part::Cloth, DegradedReason::ClothUnavailable),
            (Part::Tracking, DegradedReason::TrackingUnavailable),
        ] {
            let begun = Instant::now();
            kiosk.kill(part);
            w.degraded(reason).await;
            let told = begun.elapsed();
            let p = w.picture(TryOnState::Degraded).await;
            assert_eq!(
                (p.reason(), p.outfit_revision),
                (reason, 0),
                "the plain picture, marked"
            );
            kiosk.restart(part);
            let begun = Instant::now();
            w.picture(TryOnState::Live).await;
            println!(
                "{part:?}: told after {told:.2?}, live {:.2?} after the restart",
                begun.elapsed()
            );
            assert!(told < TOLD, "{part:?}: {told:?}");
        }
    });
}

#[test]
fn a_person_who_leaves_degrades_with_the_reason_and_comes_back_live() {
    let kiosk = Kiosk::start("synth:leave", 10.0);
    client(async {
        let mut w = Watcher::open(&kiosk, "walk", "front", &["tshirt"]).await;
        w.picture(TryOnState::Live).await;
        for _ in 0..2 {
            let gone = |e: &Event| {
                matches!(e, Event::Picture(p) if p.state() == TryOnState::Degraded
                    && matches!(p.reason(), DegradedReason::PersonLeft | DegradedReason::TrackingLost))
            };
            let Event::Picture(p) = w.until("the person gone", gone).await else {
                unreachable!("just matched")
            };
            assert_eq!(p.outfit_revision, 0, "no garments on nobody");
            let live = w.picture(TryOnState::Live).await;
            assert!(live.frame.expect("an id").sequence > p.frame.expect("an id").sequence);
        }
    });
}

#[test]
fn an_empty_room_says_nobody_is_there() {
    let kiosk = Kiosk::start("synth:empty", 10.0);
    client(async {
        let mut w = Watcher::open(&kiosk, "empty", "front", &["tshirt"]).await;
        w.degraded(DegradedReason::NoPerson).await;
        let p = w.picture(TryOnState::Degraded).await;
        assert_eq!(
            (p.reason(), p.outfit_revision),
            (DegradedReason::NoPerson, 0)
        );
    });
}

#[test]
fn bad_requests_name_their_fields_and_disturb_nobody() {
    let kiosk = Kiosk::start("pattern", 10.0);
    client(async {
        let mut w = Watcher::open(&kiosk, "good", "front", &[]).await;
        w.picture(TryOnState::Degraded).await;
        let mut c = kiosk.compositor();
        let field = |s: tonic::Status| {
            assert_eq!(s.code(), Code::InvalidArgument, "{s}");
            let details = s.get_error_details();
            details.bad_request().expect("BadRequest").field_violations[0]
                .field
                .clone()
        };
        let open = |camera: &str, garments| OpenTryOnRequest {
            try_on_id: "bad".into(),
            store: String::new(),
            camera: camera.into(),
            garments,
        };
        let e = c
            .open_try_on(open("*", vec![]))
            .await
            .expect_err("a wildcard");
        assert_eq!(field(e), "open_try_on_request.camera");
        let e = c
            .open_try_on(open("front", wear(&["cape"])))
            .await
            .expect_err("no cape");
        assert_eq!(field(e), "open_try_on_request.garments[0].garment");
        let mut huge = wear(&["tshirt"]);
        huge[0].size = "XXXXXL".into();
        let e = c
            .choose_garments(ChooseGarmentsRequest {
                try_on_id: "good".into(),
                garments: huge,
            })
            .await;
        assert_eq!(
            field(e.expect_err("no such size")),
            "choose_garments_request.garments[0].size"
        );
        let e = c
            .stream_frames(StreamFramesRequest {
                width: 5,
                height: 5,
                ..Default::default()
            })
            .await;
        assert_eq!(
            field(e.expect_err("too small")),
            "stream_frames_request.width"
        );
        let e = c
            .stream_frames(StreamFramesRequest {
                try_on_id: "nobody".into(),
                ..Default::default()
            })
            .await;
        assert_eq!(e.expect_err("unknown").code(), Code::NotFound);
        let mut capture = CaptureServiceClient::new(kiosk.channel(Part::Capture));
        let r = StartRecordingRequest {
            camera: "front".into(),
            consent: false,
        };
        assert_eq!(
            capture
                .start_recording(r)
                .await
                .expect_err("no consent")
                .code(),
            Code::FailedPrecondition
        );
        let e = capture
            .start_camera(StartCameraRequest {
                camera: "front".into(),
            })
            .await;
        assert_eq!(e.expect_err("it runs").code(), Code::FailedPrecondition);
        huge_length_prefix(kiosk.config.compositor.address).await;
        w.picture(TryOnState::Degraded).await;
    });
}

/// A gRPC message that announces 4 GiB: an error, no allocation, and the server lives.
async fn huge_length_prefix(address: std::net::SocketAddr) {
    use std::io::{Read, Write};
    let mut s = std::net::TcpStream::connect(address).expect("connects");
    let body = [0u8, 0xff, 0xff, 0xff, 0xff, 1, 2, 3];
    let head = "POST /tryon.v1.CompositorService/OpenTryOn HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\
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

#[test]
fn a_slow_reader_delays_nobody_and_a_stopped_camera_only_its_own() {
    let kiosk = Kiosk::start("pattern", 20.0);
    client(async {
        let _asleep = Watcher::open(&kiosk, "x", "front", &[]).await;
        let mut w = Watcher::open(&kiosk, "x", "front", &[]).await;
        let mut other = Watcher::open(&kiosk, "y", "side", &[]).await;
        let first = w
            .picture(TryOnState::Degraded)
            .await
            .frame
            .expect("an id")
            .sequence;
        let mut last = first;
        let mut got = 0;
        while last < first + 60 {
            last = w
                .picture(TryOnState::Degraded)
                .await
                .frame
                .expect("an id")
                .sequence;
            got += 1;
        }
        assert!(
            got >= 20,
            "{got} pictures of 60 frames beside a reader that sleeps"
        );
        let mut capture = CaptureServiceClient::new(kiosk.channel(Part::Capture));
        capture
            .stop_camera(StopCameraRequest {
                camera: "side".into(),
            })
            .await
            .expect("stopped");
        other.degraded(DegradedReason::CameraSilent).await;
        w.picture(TryOnState::Degraded).await;
        capture
            .start_camera(StartCameraRequest {
                camera: "side".into(),
            })
            .await
            .expect("started");
        other.picture(TryOnState::Degraded).await;
    });
}

#[test]
fn shutdown_with_an_open_stream_ends_within_its_deadline() {
    let mut kiosk = Kiosk::start("pattern", 10.0);
    client(async {
        let mut w = Watcher::open(&kiosk, "open", "front", &[]).await;
        w.picture(TryOnState::Degraded).await;
        let grace = Duration::from_millis(kiosk.config.process.grace_ms);
        let watching = tokio::spawn(async move {
            let mut last = None;
            loop {
                match w.next().await {
                    Ok(Event::Status(s)) => last = Some(s.state()),
                    Ok(Event::Picture(_)) => {}
                    Err(s) => return (last, s),
                }
            }
        });
        let (outcome, took) = tokio::task::block_in_place(|| kiosk.stop(Part::Compositor));
        println!("compositor with an open stream: {outcome:?} after {took:.2?}");
        assert!(took < grace + Duration::from_secs(1), "{took:?}");
        let (last, end) = watching.await.expect("ends");
        assert_eq!(
            last,
            Some(TryOnState::Draining),
            "the stream says why it ends: {end}"
        );
        for part in [Part::Cloth, Part::Tracking, Part::Capture] {
            let (outcome, took) = tokio::task::block_in_place(|| kiosk.stop(part));
            assert!(took < grace + Duration::from_secs(1), "{part:?} {took:?}");
            assert!(matches!(outcome, Outcome::Clean | Outcome::DeadlineHit));
        }
    });
}
