//! Start and end of a try-on's task, with the streams from the services behind it.

use super::handle::{Handle, Setup};
use super::lifecycle::Lifecycle;
use super::task::{Inputs, Outputs, Task};
use crate::upstream::{self, Wanted};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Semaphore, mpsc, watch};
use tokio_util::sync::CancellationToken;
use tryon::session::SilenceLimits;
use tryon_kit::auth::Connection;
use tryon_kit::bodies::{self, Opening};
use tryon_kit::client::{CALL_DEADLINE, channel, request};
use tryon_kit::config::CompositorConfig;
use tryon_kit::consent::{self, Lease};
use tryon_kit::queue::latest;
use tryon_kit::remembered_body::RememberedBody;
use tryon_kit::session_task::{self, Place};
use tryon_kit::sessions::brief;
use tryon_proto::v1::tracking_service_client::TrackingServiceClient;
use tryon_proto::v1::{CloseSessionRequest, UndressRequest};

/// Silence of tracking that counts as a fault while it has a session. Its stream repeats itself twice a second.
const TRACKING_SILENCE: Duration = Duration::from_millis(800);

/// Starts the task of a try-on.
pub(crate) fn spawn(mut setup: Setup) -> Handle {
    let (commands, inbox) = mpsc::channel(8);
    let choices = std::mem::take(&mut setup.choices);
    let wanted = watch::Sender::new(Wanted {
        revision: 1,
        choices,
        sizes: None,
    });
    let (key, outfit) = (setup.key.clone(), wanted.clone());
    let over = CancellationToken::new();
    let done = over.clone().drop_guard();
    tokio::spawn(async move {
        let _done = done;
        let id = setup.id.clone();
        let is_over = |h: &Handle| h.commands.is_closed();
        let _place = Place::new(setup.directory.clone(), &id, "tryon_try_ons", is_over);
        let photos = setup.photos.clone();
        let why = run(setup, inbox, outfit).await;
        photos.forget(&id);
        tracing::info!(try_on = brief(&id), why, "closed");
    });
    Handle {
        key,
        commands,
        wanted,
        fine: Arc::new(Semaphore::new(1)),
        over,
    }
}

/// Follows camera, tracking and cloth until the task ends; the reason of the end.
async fn run(
    setup: Setup,
    inbox: mpsc::Receiver<super::Command>,
    outfit: watch::Sender<Wanted>,
) -> &'static str {
    let frames = match setup.ctx.bus.subscribe(&setup.key).await {
        Ok(f) => f,
        Err(e) => {
            tracing::error!(try_on = brief(&setup.id), error = %e, "cannot subscribe");
            return "the bus refused";
        }
    };
    // One connection for each stream; both URLs were checked at the start.
    let (Ok(tracking), Ok(cloth)) = (
        channel(&setup.config.tracking, &setup.ctx.inside),
        channel(&setup.config.cloth, &setup.ctx.inside),
    ) else {
        return "a URL is none";
    };
    let credentials = setup.ctx.auth.credentials();
    let (tracking, cloth) = (credentials.present(tracking), credentials.present(cloth));
    let id = setup.id.clone();

    // The caller that opened it is about to stream.
    let (is_watched, watched) = watch::channel(true);
    let (key_sender, keys) = watch::channel(None);
    let lease = Lease {
        camera: setup.key.clone(),
        holder: id.clone(),
    };
    let bus = setup.ctx.bus.clone();
    let cameras = setup.cameras.clone();
    let consent = tokio::spawn(consent::keep(cameras, lease, bus, watched, key_sender));

    let (tx, bodies) = latest::channel();
    let known = RememberedBody::default();
    let opening = Opening {
        camera: setup.key.clone(),
        keys,
        known: known.clone(),
    };
    let follow_bodies = tokio::spawn(bodies::follow(
        tracking.clone(),
        id.clone(),
        Some(opening),
        setup.ctx.pool.clone(),
        tx,
    ));
    let (tx, garments) = latest::channel();
    let wanted = outfit.subscribe();
    let follow_garments = tokio::spawn(upstream::follow(cloth.clone(), id.clone(), wanted, tx));

    let life = Lifecycle::new(id.clone(), limits(&setup.config));
    let (done, drawn) = mpsc::channel(1);
    let inputs = Inputs {
        inbox,
        frames,
        bodies,
        garments,
        drawn,
    };
    let outputs = Outputs {
        done,
        is_watched,
        known: known.clone(),
        outfit,
    };
    let task = Task::new(setup, life, outputs).run(inputs);
    let why = session_task::run("compositor", &id, task).await;
    known.forget();

    // The sender that it watches is gone with the task: the camera stops first.
    let _ = tokio::time::timeout(CALL_DEADLINE, consent).await;
    follow_bodies.abort();
    follow_garments.abort();
    close_sessions(id, tracking, cloth).await;
    why
}

fn limits(config: &CompositorConfig) -> SilenceLimits {
    SilenceLimits {
        camera_silence_ns: config.camera_silence_ms * 1_000_000,
        tracking_silence_ns: TRACKING_SILENCE.as_nanos() as u64,
        garments_age_ns: config.garments_late_ms * 1_000_000,
    }
}

/// Closes the sessions behind a try-on, within a deadline: idle ones end by themselves.
async fn close_sessions(id: String, tracking: Connection, cloth: Connection) {
    let close = async {
        let session_id = id.clone();
        let _ = TrackingServiceClient::new(tracking)
            .close_session(request(CloseSessionRequest { session_id }))
            .await;
        let _ = upstream::client(cloth)
            .undress(request(UndressRequest { session_id: id }))
            .await;
    };
    let _ = tokio::time::timeout(CALL_DEADLINE, close).await;
}
