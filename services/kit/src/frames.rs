//! Frames between processes, whatever carries them: the trait, and the carrier inside one process.

use crate::compute::Pool;
use crate::queue::latest;
use bytes::Bytes;
use prost::Message;
use std::any::Any;
use std::collections::BTreeMap;
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::watch;
use tryon::camera::Calibration;
pub use tryon_proto::convert::frame::{Exposure, exposure_from_wire, exposure_to_wire, stage};
pub use tryon_proto::keys::CameraKey;

/// A boxed future: what object-safe async traits answer.
pub type BoxFuture<'a, T> = Pin<Box<dyn Future<Output = T> + Send + 'a>>;

/// The bus refused or lost something.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("bus: {0}")]
pub struct BusError(pub String);

/// Carries exposures from cameras to whoever subscribes; newest wins everywhere.
pub trait FrameBus: Send + Sync {
    /// Announces a camera as alive and readies its keys. Dropping the publisher takes it off the bus.
    fn publish(&self, key: &CameraKey, calibration: &Calibration)
    -> BoxFuture<'_, Result<Box<dyn FramePublisher>, BusError>>;
    /// Follows a camera, which need not exist yet.
    fn subscribe(&self, key: &CameraKey) -> BoxFuture<'_, Result<FrameSubscription, BusError>>;
}

/// The publishing end of one camera.
pub trait FramePublisher: Send {
    /// Hands over one exposure.
    fn send(&mut self, exposure: Arc<Exposure>) -> BoxFuture<'_, Result<(), BusError>>;
}

/// What waits for a subscriber: unpacked inside one process, packed between processes.
pub(crate) enum Packet {
    Ready(Arc<Exposure>),
    Packed(Bytes),
}

/// The receiving end of one camera: the newest exposure, with everything it missed counted.
pub struct FrameSubscription {
    pub(crate) packets: latest::Receiver<Packet>,
    pub(crate) alive: watch::Receiver<bool>,
    pub(crate) pool: Arc<Pool>,
    pub(crate) last: Option<(u64, u64)>,
    pub(crate) skipped: u64,
    /// Keeps the carrier's own subscription open.
    pub(crate) _guard: Box<dyn Any + Send>,
}

impl FrameSubscription {
    /// The newest exposure, waiting for one; `None` when the bus is gone. Broken ones are logged and left out.
    pub async fn next(&mut self) -> Option<Arc<Exposure>> {
        loop {
            let exposure = match self.packets.recv().await? {
                Packet::Ready(e) => e,
                Packet::Packed(b) => match self.pool.run(move || unpack(b)).await {
                    Ok(Ok(e)) => Arc::new(e),
                    Ok(Err(why)) => {
                        metrics::counter!("tryon_frames_broken").increment(1);
                        tracing::warn!(%why, "left out a broken frame");
                        continue;
                    }
                    Err(why) => {
                        tracing::error!(%why, "could not unpack a frame");
                        continue;
                    }
                },
            };
            let (epoch, sequence) = (exposure.id.epoch, exposure.id.sequence);
            if let Some((e, s)) = self.last
                && e == epoch
            {
                self.skipped += sequence.saturating_sub(s + 1);
            }
            self.last = Some((epoch, sequence));
            return Some(exposure);
        }
    }
    /// Exposures of the current epoch that passed unseen.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }
    /// Whether the camera is on the bus.
    pub fn alive(&self) -> bool {
        *self.alive.borrow()
    }
}

fn unpack(b: Bytes) -> Result<Exposure, String> {
    let message = tryon_proto::v1::RgbdFrame::decode(b).map_err(|e| format!("rgbd_frame: {e}"))?;
    exposure_from_wire(&message).map_err(|e| e.to_string())
}

struct Topic {
    subscribers: Mutex<Vec<latest::Sender<Packet>>>,
    alive: watch::Sender<bool>,
}

/// The bus inside one process: exposures are shared, not packed.
#[derive(Clone)]
pub struct LocalBus {
    topics: Arc<Mutex<BTreeMap<CameraKey, Arc<Topic>>>>,
    pool: Arc<Pool>,
}

impl LocalBus {
    /// An empty bus.
    pub fn new(pool: Arc<Pool>) -> Arc<Self> {
        Arc::new(Self { topics: Arc::default(), pool })
    }
    fn topic(&self, key: &CameraKey) -> Arc<Topic> {
        let fresh = || Arc::new(Topic { subscribers: Mutex::default(), alive: watch::Sender::new(false) });
        self.topics.lock().unwrap_or_else(PoisonError::into_inner).entry(key.clone()).or_insert_with(fresh).clone()
    }
}

struct LocalPublisher(Arc<Topic>);

impl Drop for LocalPublisher {
    fn drop(&mut self) {
        self.0.alive.send_replace(false);
    }
}

impl FramePublisher for LocalPublisher {
    fn send(&mut self, exposure: Arc<Exposure>) -> BoxFuture<'_, Result<(), BusError>> {
        let mut list = self.0.subscribers.lock().unwrap_or_else(PoisonError::into_inner);
        list.retain(|s| s.send(Packet::Ready(exposure.clone())));
        Box::pin(std::future::ready(Ok(())))
    }
}

impl FrameBus for LocalBus {
    fn publish(&self, key: &CameraKey, _: &Calibration) -> BoxFuture<'_, Result<Box<dyn FramePublisher>, BusError>> {
        let topic = self.topic(key);
        topic.alive.send_replace(true);
        Box::pin(std::future::ready(Ok(Box::new(LocalPublisher(topic)) as Box<dyn FramePublisher>)))
    }
    fn subscribe(&self, key: &CameraKey) -> BoxFuture<'_, Result<FrameSubscription, BusError>> {
        let topic = self.topic(key);
        let (tx, packets) = latest::channel();
        topic.subscribers.lock().unwrap_or_else(PoisonError::into_inner).push(tx);
        let alive = topic.alive.subscribe();
        let pool = self.pool.clone();
        let s = FrameSubscription { packets, alive, pool, last: None, skipped: 0, _guard: Box::new(topic) };
        Box::pin(std::future::ready(Ok(s)))
    }
}
