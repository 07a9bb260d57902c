//! Frame bus: the trait, and its implementation inside one process.

use crate::compute::{ComputeError, Pool};
use crate::frame_order::FrameOrder;
use crate::queue::latest;
use crate::seal::{KeyRing, Sealer, Unsealing};
use bytes::Bytes;
use std::any::Any;
use std::collections::BTreeMap;
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::watch;
use tokio::time::Instant;
use tryon_geometry::camera::Calibration;
use tryon_proto::Message;
pub use tryon_proto::convert::frame::{Exposure, exposure_from_wire, exposure_to_wire, stage};
pub use tryon_proto::keys::CameraKey;
use tryon_proto::v1::{FrameKey, RgbdFrame};

/// Future of an object-safe async method.
pub type BoxFuture<'a, T> = Pin<Box<dyn Future<Output = T> + Send + 'a>>;

/// The bus refused or lost something.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("bus: {0}")]
pub struct BusError(pub String);

/// Transport of exposures from cameras to subscribers; the newest wins everywhere.
pub trait FrameBus: Send + Sync {
    /// Announces a camera as alive and readies its keys. Dropping the publisher takes it off the bus.
    fn publish(
        &self,
        key: &CameraKey,
        calibration: &Calibration,
    ) -> BoxFuture<'_, Result<Box<dyn FramePublisher>, BusError>>;
    /// Follows a camera, which need not exist yet.
    fn subscribe(&self, key: &CameraKey) -> BoxFuture<'_, Result<FrameSubscription, BusError>>;
    /// Takes a key that frames of a camera are sealed with, for all subscriptions of this process.
    fn learn(&self, camera: &CameraKey, key: &FrameKey);
}

/// Publishing end of one camera.
pub trait FramePublisher: Send {
    /// Publishes one exposure, sealed wherever it leaves the process; true when somebody receives it.
    fn send(
        &mut self,
        exposure: Arc<Exposure>,
        sealer: Arc<Sealer>,
    ) -> BoxFuture<'_, Result<bool, BusError>>;
}

/// Exposure in a subscriber's queue: unpacked inside one process, sealed between processes.
pub(crate) enum Packet {
    Ready(Arc<Exposure>),
    Sealed(Vec<u8>),
}

/// Receiving end of one camera: the newest exposure, with missed ones counted.
pub struct FrameSubscription {
    pub(crate) packets: latest::Receiver<Packet>,
    pub(crate) alive: watch::Receiver<bool>,
    pub(crate) pool: Arc<Pool>,
    unsealing: Unsealing,
    /// Frame that the pool unpacks; kept here, so that dropping the future of [`Self::next`] loses nothing.
    unpacking: Option<BoxFuture<'static, Result<Result<Exposure, String>, ComputeError>>>,
    order: FrameOrder,
    /// Keeps the transport's own subscription open.
    _guard: Box<dyn Any + Send>,
}

impl FrameSubscription {
    pub(crate) fn new(
        packets: latest::Receiver<Packet>,
        alive: watch::Receiver<bool>,
        pool: Arc<Pool>,
        unsealing: Unsealing,
        guard: Box<dyn Any + Send>,
    ) -> Self {
        Self {
            packets,
            alive,
            pool,
            unsealing,
            unpacking: None,
            order: FrameOrder::default(),
            _guard: guard,
        }
    }

    /// The newest exposure, waiting for one; `None` when the bus is gone. Broken ones, and those that are not after all
    /// before, are counted and left out.
    ///
    /// Cancel safe.
    pub async fn next(&mut self) -> Option<Arc<Exposure>> {
        loop {
            let exposure = if let Some(work) = &mut self.unpacking {
                let unpacked = work.await;
                self.unpacking = None;
                match unpacked {
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
                }
            } else {
                match self.packets.recv().await? {
                    Packet::Ready(e) => e,
                    Packet::Sealed(b) => {
                        let (pool, unsealing) = (self.pool.clone(), self.unsealing.clone());
                        let work = move || unpack(&unsealing, b);
                        self.unpacking = Some(Box::pin(async move { pool.run(work).await }));
                        continue;
                    }
                }
            };
            if self.order.admit(exposure.id.epoch, exposure.id.sequence) {
                return Some(exposure);
            }
            metrics::counter!("tryon_frames_out_of_order").increment(1);
        }
    }
    /// The newest exposure from `due` on: those before it are left out, neither unpacked nor counted as missed.
    ///
    /// Cancel safe.
    pub async fn next_from(&mut self, due: Instant) -> Option<Arc<Exposure>> {
        if self.unpacking.is_none() && due > Instant::now() {
            self.order.pause();
            tokio::time::sleep_until(due).await;
        }
        self.next().await
    }
    /// Number of missed exposures.
    pub fn skipped(&self) -> u64 {
        self.order.missed()
    }
    /// The camera is on the bus.
    pub fn alive(&self) -> bool {
        *self.alive.borrow()
    }
}

fn unpack(unsealing: &Unsealing, mut payload: Vec<u8>) -> Result<Exposure, String> {
    let start = unsealing.open(&mut payload).map_err(|e| e.to_string())?;
    let message = Bytes::from(payload).slice(start..);
    let message = RgbdFrame::decode(message).map_err(|e| format!("rgbd_frame: {e}"))?;
    exposure_from_wire(&message).map_err(|e| e.to_string())
}

struct Topic {
    subscribers: Mutex<Vec<latest::Sender<Packet>>>,
    alive: watch::Sender<bool>,
}

/// Bus inside one process: exposures are shared, not packed.
#[derive(Clone)]
pub struct LocalBus {
    topics: Arc<Mutex<BTreeMap<CameraKey, Arc<Topic>>>>,
    pool: Arc<Pool>,
}

impl LocalBus {
    /// An empty bus.
    pub fn new(pool: Arc<Pool>) -> Arc<Self> {
        Arc::new(Self {
            topics: Arc::default(),
            pool,
        })
    }
    fn topic(&self, key: &CameraKey) -> Arc<Topic> {
        let fresh = || {
            Arc::new(Topic {
                subscribers: Mutex::default(),
                alive: watch::Sender::new(false),
            })
        };
        self.topics
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .entry(key.clone())
            .or_insert_with(fresh)
            .clone()
    }
}

struct LocalPublisher(Arc<Topic>);

impl Drop for LocalPublisher {
    fn drop(&mut self) {
        self.0.alive.send_replace(false);
    }
}

impl FramePublisher for LocalPublisher {
    fn send(
        &mut self,
        exposure: Arc<Exposure>,
        _: Arc<Sealer>,
    ) -> BoxFuture<'_, Result<bool, BusError>> {
        let mut list = self
            .0
            .subscribers
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        list.retain(|s| s.send(Packet::Ready(exposure.clone())));
        let is_received = !list.is_empty();
        Box::pin(std::future::ready(Ok(is_received)))
    }
}

impl FrameBus for LocalBus {
    fn publish(
        &self,
        key: &CameraKey,
        _: &Calibration,
    ) -> BoxFuture<'_, Result<Box<dyn FramePublisher>, BusError>> {
        let topic = self.topic(key);
        topic.alive.send_replace(true);
        Box::pin(std::future::ready(Ok(
            Box::new(LocalPublisher(topic)) as Box<dyn FramePublisher>
        )))
    }
    fn subscribe(&self, key: &CameraKey) -> BoxFuture<'_, Result<FrameSubscription, BusError>> {
        let topic = self.topic(key);
        let (tx, packets) = latest::channel();
        topic
            .subscribers
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(tx);
        let alive = topic.alive.subscribe();
        let unsealing = Unsealing::new(Arc::new(KeyRing::default()), key.clone());
        let pool = self.pool.clone();
        let s = FrameSubscription::new(packets, alive, pool, unsealing, Box::new(topic));
        Box::pin(std::future::ready(Ok(s)))
    }
    fn learn(&self, _: &CameraKey, _: &FrameKey) {}
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::time::Duration;
    use tryon_geometry::camera::{ColorImage, DepthImage, Intrinsics, RgbdFrame};
    use tryon_proto::v1::FrameId;

    pub(crate) fn exposure(sequence: u64) -> Arc<Exposure> {
        let k = Intrinsics::KINECT_V1.resized(320, 240);
        let id = FrameId {
            epoch: 5,
            sequence,
            capture_time_ns: sequence,
            received_unix_ns: 1,
            trace: 0,
        };
        let rgbd = RgbdFrame {
            sequence,
            time_ns: sequence,
            depth: DepthImage::empty(320, 240),
            color: Some(ColorImage::filled(320, 240, [9; 3])),
        };
        Arc::new(Exposure {
            id,
            calibration: Arc::new(Calibration::registered(k)),
            rgbd,
            stages: vec![],
        })
    }

    /// Contract of every bus: the newest wins, order holds, a camera's presence is reported.
    pub(crate) async fn fulfils_the_contract(
        publishing: &dyn FrameBus,
        subscribing: &dyn FrameBus,
    ) {
        let key = CameraKey::new("store", "front").expect("names");
        let sealer = Arc::new(Sealer::draw().expect("random"));
        let mut s = subscribing.subscribe(&key).await.expect("subscribed");
        subscribing.learn(&key, sealer.key());
        assert!(!s.alive());
        let mut p = publishing
            .publish(&key, &exposure(0).calibration)
            .await
            .expect("published");
        // A peer that connects later misses earlier frames: send until one arrives.
        let mut sequence = 0;
        let first = loop {
            sequence += 1;
            p.send(exposure(sequence), sealer.clone())
                .await
                .expect("sent");
            if let Ok(f) = tokio::time::timeout(Duration::from_millis(50), s.next()).await {
                break f.expect("the bus lives");
            }
            assert!(sequence < 400, "nothing arrived");
        };
        for _ in 0..10 {
            sequence += 1;
            p.send(exposure(sequence), sealer.clone())
                .await
                .expect("sent");
        }
        let mut last = first.id.sequence;
        while last < sequence {
            let f = s.next().await.expect("the bus lives");
            assert!(f.id.sequence > last, "in order, none twice");
            last = f.id.sequence;
        }
        leaves_out_disorder(p.as_mut(), &mut s, &sealer, last).await;
        assert!(s.alive());
        drop(p);
        for _ in 0..100 {
            if !s.alive() {
                return;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        panic!("the camera still counts as alive");
    }

    /// Sends doubles, late frames and gaps after frame `last`, each sealed anew: what is not after all before stays out.
    async fn leaves_out_disorder(
        p: &mut dyn FramePublisher,
        s: &mut FrameSubscription,
        sealer: &Arc<Sealer>,
        last: u64,
    ) {
        let missed = s.skipped();
        let brought = [
            (2, true),
            (2, false),
            (1, false),
            (3, true),
            (0, false),
            (9, true),
        ];
        for (step, is_new) in brought {
            let sent = exposure(last + step);
            p.send(sent, sealer.clone()).await.expect("sent");
            let patience = Duration::from_millis(if is_new { 5000 } else { 200 });
            let next = tokio::time::timeout(patience, s.next()).await.ok();
            let next = next.map(|f| f.expect("the bus lives").id.sequence);
            assert_eq!(next, is_new.then_some(last + step));
        }
        assert_eq!(s.skipped() - missed, 1 + 5, "what was lost is counted");
    }

    #[tokio::test]
    async fn exposures_before_a_time_are_left_out() {
        let bus = LocalBus::new(Pool::new(1).expect("a thread"));
        let key = CameraKey::new("store", "front").expect("names");
        let mut s = bus.subscribe(&key).await.expect("subscribed");
        let mut p = (bus.publish(&key, &exposure(0).calibration).await).expect("published");
        let sealer = Arc::new(Sealer::draw().expect("random"));
        p.send(exposure(1), sealer.clone()).await.expect("sent");
        assert_eq!(s.next().await.expect("lives").id.sequence, 1);
        let due = Instant::now() + Duration::from_millis(50);
        let sending = async {
            for sequence in 2..5 {
                p.send(exposure(sequence), sealer.clone())
                    .await
                    .expect("sent");
            }
        };
        let (next, ()) = tokio::join!(s.next_from(due), sending);
        assert_eq!(next.expect("lives").id.sequence, 4);
        assert!(Instant::now() >= due);
        assert_eq!(s.skipped(), 0, "left out on purpose");
    }

    #[tokio::test]
    async fn local_bus_fulfils_the_contract() {
        let bus = LocalBus::new(Pool::new(1).expect("a thread"));
        fulfils_the_contract(bus.as_ref(), bus.as_ref()).await;
    }
}
