//! Restarts: whoever stands before the camera keeps size and garments, and nobody else does.

use crate::client;
use crate::faults::TOLD;
use crate::kiosk::{Kiosk, PATIENCE, Part, Watcher};
use std::time::{Duration, Instant};
use tokio_stream::StreamExt;
use tonic::Code;
use tryon_proto::v1::tracking_service_client::TrackingServiceClient;
use tryon_proto::v1::*;

/// Time within which pictures are live again after a restart, of a debug build on a machine that runs other tests too.
const LIVE_AGAIN: Duration = Duration::from_secs(15);

/// A T-shirt in the size that suits.
fn any_size() -> Vec<GarmentChoice> {
    vec![GarmentChoice {
        garment: "tshirt".into(),
        ..GarmentChoice::default()
    }]
}

/// Opens the try-on of a shopper who leaves the size open.
async fn shopper(kiosk: &Kiosk) -> Watcher {
    let watcher = Watcher::open(kiosk, "shopper", "front", &[]).await;
    let choose = ChooseGarmentsRequest {
        try_on_id: "shopper".into(),
        garments: any_size(),
    };
    let begun = Instant::now();
    while let Err(s) = kiosk.compositor().choose_garments(choose.clone()).await {
        assert!(
            s.code() == Code::Unavailable && begun.elapsed() < PATIENCE,
            "{s}"
        );
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    watcher
}

/// Size of the T-shirt, once it is final.
async fn final_size(watcher: &mut Watcher) -> String {
    let is_final = |p: &Picture| {
        p.state() == TryOnState::Live && p.fit.first().is_some_and(|f| !f.provisional)
    };
    let picture = watcher.picture_where("a final size", is_final).await;
    picture.fit[0].size.clone()
}

/// The first state of tracking with a body, and its shape.
async fn first_body(kiosk: &Kiosk) -> (BodyState, BodyShape) {
    let begun = Instant::now();
    while begun.elapsed() < PATIENCE {
        let mut tracking = TrackingServiceClient::new(kiosk.channel(Part::Tracking));
        let session_id = "shopper".into();
        let states = tracking.stream_body_states(StreamBodyStatesRequest { session_id });
        let Ok(states) = states.await else {
            tokio::time::sleep(Duration::from_millis(20)).await;
            continue;
        };
        let mut states = states.into_inner();
        let mut shape = None;
        while let Some(Ok(message)) = states.next().await {
            let mut state = message.state.expect("a state");
            shape = state.shape.take().or(shape);
            if state.age_frames == 0
                && state.pose.is_some()
                && state.status() != TrackingStatus::Lost
            {
                return (state, shape.expect("with a pose"));
            }
        }
    }
    panic!("no body within {PATIENCE:?}");
}

#[test]
fn size_and_garments_survive_the_restart_of_any_service() {
    let mut kiosk = Kiosk::start("synth:still", 10.0);
    client(async {
        let mut watcher = shopper(&kiosk).await;
        let size = final_size(&mut watcher).await;
        let (before, shape) = first_body(&kiosk).await;
        assert_eq!(before.status(), TrackingStatus::Tracking);

        for part in [Part::Tracking, Part::Cloth, Part::Capture] {
            let reason = match part {
                Part::Cloth => DegradedReason::ClothUnavailable,
                Part::Tracking => DegradedReason::TrackingUnavailable,
                _ => DegradedReason::CameraSilent,
            };
            let begun = Instant::now();
            kiosk.kill(part);
            watcher.degraded(reason).await;
            let told = begun.elapsed();
            assert!(told < TOLD, "{part:?}: {told:?}");
            if part != Part::Capture {
                let plain = watcher.picture(TryOnState::Degraded).await;
                let marks = (plain.reason(), plain.outfit_revision);
                assert_eq!(marks, (reason, 0), "the plain picture, marked");
            }
            // Long enough for every service to forget who was there.
            tokio::time::sleep(Duration::from_millis(1500)).await;
            kiosk.restart(part);
            let begun = Instant::now();
            if part != Part::Cloth {
                let (state, again) = first_body(&kiosk).await;
                assert_eq!(
                    state.status(),
                    TrackingStatus::Tracking,
                    "{part:?}: measured again"
                );
                assert_eq!(state.subject, before.subject, "{part:?}");
                assert_eq!(again.coefficients, shape.coefficients, "{part:?}");
                assert_eq!(again.bone_scales, shape.bone_scales, "{part:?}");
            }
            let live = watcher.picture(TryOnState::Live).await;
            let took = begun.elapsed();
            println!("{part:?}: live {took:.2?} after the restart");
            assert!(took < LIVE_AGAIN, "{part:?}: {took:?}");
            assert!(live.outfit_revision > 0, "{part:?}");
            assert_eq!(final_size(&mut watcher).await, size, "{part:?}");
        }

        kiosk.kill(Part::Compositor);
        kiosk.restart(Part::Compositor);
        let begun = Instant::now();
        let mut watcher = shopper(&kiosk).await;
        watcher.picture(TryOnState::Live).await;
        println!("Compositor: live {:.2?} after the restart", begun.elapsed());
        assert_eq!(final_size(&mut watcher).await, size);
    });
}

#[test]
fn a_body_is_forgotten_with_the_consent() {
    let kiosk = Kiosk::start("synth:still", 10.0);
    client(async {
        let mut watcher = shopper(&kiosk).await;
        final_size(&mut watcher).await;
        let withdraw = WithdrawConsentRequest {
            try_on_id: "shopper".into(),
        };
        let withdrawn = kiosk.compositor().withdraw_consent(withdraw).await;
        withdrawn.expect("withdrawn");
        while watcher.next().await.is_ok() {}

        // The next person has the same number and the same camera, within the time of the memory.
        let _watcher = shopper(&kiosk).await;
        let (state, _) = first_body(&kiosk).await;
        assert_eq!(
            state.status(),
            TrackingStatus::Calibrating,
            "measured from nothing"
        );
    });
}
