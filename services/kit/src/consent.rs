//! Lease of consent at the capture service: a camera publishes only while somebody who watches renews it.

use crate::auth::Connection;
use crate::frames::{CameraKey, FrameBus};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::watch;
use tonic::{Code, Status};
use tryon_proto::v1::capture_service_client::CaptureServiceClient;
use tryon_proto::v1::{FrameKey, HoldConsentRequest, ListCamerasRequest};

/// Length of a lease (s): a holder that is lost stops the camera this much later.
pub const LEASE_S: f32 = 1.0;
/// Silence of a camera after which nobody knows who stands there: every service forgets what it knew of the body, but for the
/// size and shape that the one who asks remembers for [`REMEMBER_FOR`].
pub const FORGET_AFTER: Duration = Duration::from_secs(1);
/// Time for which the holder of a consent remembers the settled size and shape of a person who is no longer seen, and for
/// which tracking waits for that person: twice what the start of a service takes.
pub const REMEMBER_FOR: Duration = Duration::from_secs(10);
/// Interval of renewals: three may be lost before a lease ends.
const RENEW_EVERY: Duration = Duration::from_millis(250);
/// Pause after a renewal that failed.
const RETRY: Duration = Duration::from_millis(100);
/// Time that an answer may take.
const DEADLINE: Duration = Duration::from_millis(500);

/// Cameras of the capture service.
#[derive(Clone)]
pub struct Cameras(CaptureServiceClient<Connection>);

impl Cameras {
    /// Cameras of the capture service behind `channel`.
    pub fn new(channel: Connection) -> Self {
        Self(CaptureServiceClient::new(channel))
    }

    /// The capture service has this camera, running or not.
    ///
    /// # Errors
    /// When it does not answer.
    pub async fn has(&self, key: &CameraKey) -> Result<bool, Status> {
        let answer = self
            .0
            .clone()
            .list_cameras(soon(ListCamerasRequest {}))
            .await?;
        let is =
            |c: &tryon_proto::v1::CameraInfo| c.store == key.store() && c.camera == key.camera();
        Ok(answer.into_inner().cameras.iter().any(is))
    }

    async fn hold(&self, lease: &Lease, seconds: f32) -> Result<Option<FrameKey>, Status> {
        let message = HoldConsentRequest {
            camera: lease.camera.camera().into(),
            try_on_id: lease.holder.clone(),
            seconds,
            store: lease.camera.store().into(),
        };
        let answer = self.0.clone().hold_consent(soon(message)).await?;
        Ok(answer.into_inner().key)
    }
}

/// Request with the deadline of this module.
fn soon<T>(message: T) -> tonic::Request<T> {
    let mut request = tonic::Request::new(message);
    request.set_timeout(DEADLINE);
    request
}

/// Camera and holder of a lease.
pub struct Lease {
    /// Camera that the person stands before.
    pub camera: CameraKey,
    /// Id of the try-on.
    pub holder: String,
}

/// Current key of the frames; `None` before the first lease.
pub type Keys = watch::Receiver<Option<FrameKey>>;

/// Holds `lease` whenever `is_watched` is true, hands its keys to `bus` and `keys`, and ends it when `is_watched` turns
/// false or its sender is gone.
///
/// # Errors
/// When the last lease could not be ended: it ends by itself within [`LEASE_S`].
pub async fn keep(
    cameras: Cameras,
    lease: Lease,
    bus: Arc<dyn FrameBus>,
    mut is_watched: watch::Receiver<bool>,
    keys: watch::Sender<Option<FrameKey>>,
) -> Result<(), Status> {
    let mut ended = Ok(());
    loop {
        let is_begun = is_watched.wait_for(|w| *w).await.is_ok();
        // A receiver whose sender is gone cannot tell whether the value has changed.
        if !is_begun || is_watched.has_changed().is_err() {
            return ended;
        }
        hold(&cameras, &lease, bus.as_ref(), &mut is_watched, &keys).await;
        ended = cameras.hold(&lease, 0.0).await.map(drop);
        if let Err(why) = &ended {
            tracing::warn!(camera = %lease.camera, %why, "a lease of consent could not be ended");
        }
    }
}

/// Renews until nobody watches.
async fn hold(
    cameras: &Cameras,
    lease: &Lease,
    bus: &dyn FrameBus,
    is_watched: &mut watch::Receiver<bool>,
    keys: &watch::Sender<Option<FrameKey>>,
) {
    let mut told = Code::Ok;
    loop {
        let pause = match cameras.hold(lease, LEASE_S).await {
            Ok(key) => {
                told = Code::Ok;
                if let Some(key) = key {
                    bus.learn(&lease.camera, &key);
                    keys.send_if_modified(|k| {
                        let is_new = k.as_ref().is_none_or(|k| k.id != key.id);
                        *k = Some(key);
                        is_new
                    });
                }
                RENEW_EVERY
            }
            Err(why) => {
                if told != why.code() {
                    tracing::warn!(camera = %lease.camera, %why, "no lease of consent");
                }
                told = why.code();
                RETRY
            }
        };
        let is_over = is_watched.wait_for(|w| !w);
        if tokio::time::timeout(pause, is_over).await.is_ok() {
            return;
        }
    }
}
