//! Faults and absences: killed services, an absent person, slow readers, stopped cameras, shutdown.

use crate::client;
use crate::kiosk::{Kiosk, PARTS, Part, Watcher};
use std::time::{Duration, Instant};
use tonic::Code;
use tryon_kit::server::Outcome;
use tryon_proto::v1::capture_service_client::CaptureServiceClient;
use tryon_proto::v1::stream_frames_response::Event;
use tryon_proto::v1::*;

/// Time within which a client is told of a killed service.
pub const TOLD: Duration = Duration::from_secs(1);
/// Time within which pictures are back after its restart.
const BACK: Duration = Duration::from_secs(5);

#[test]
fn any_service_killed_is_told_within_a_second_and_back_within_five() {
    // Without a person the try-on is Degraded(NO_PERSON) while all services run, and pictures are plain.
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
                // The absent person is the more upstream fault and hides that of cloth.
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
            let as_before = |p: &Picture| p.reason() == DegradedReason::NoPerson;
            w.picture_where("a picture as before", as_before).await;
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
fn a_person_who_leaves_degrades_with_the_reason_and_comes_back_live() {
    let kiosk = Kiosk::start("synth:leave", 10.0);
    client(async {
        let mut w = Watcher::open(&kiosk, "walk", "front", &["tshirt"]).await;
        w.picture(TryOnState::Live).await;
        for _ in 0..2 {
            let gone = |p: &Picture| {
                use DegradedReason::{PersonLeft, TrackingLost};
                p.state() == TryOnState::Degraded && matches!(p.reason(), PersonLeft | TrackingLost)
            };
            let p = w.picture_where("the person gone", gone).await;
            assert_eq!(p.outfit_revision, 0, "no garments on nobody");
            let live = w.picture(TryOnState::Live).await;
            assert!(live.frame.expect("an id").sequence > p.frame.expect("an id").sequence);
        }
    });
}

#[test]
fn a_person_who_sits_is_told_so_and_not_dressed() {
    let kiosk = Kiosk::start("synth:seated", 10.0);
    client(async {
        let mut w = Watcher::open(&kiosk, "seat", "front", &["tshirt"]).await;
        w.degraded(DegradedReason::PersonSits).await;
        let p = w.picture(TryOnState::Degraded).await;
        assert_eq!(
            (p.reason(), p.outfit_revision),
            (DegradedReason::PersonSits, 0)
        );
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
