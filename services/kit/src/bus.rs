//! Frame bus between processes over zenoh, the only file that names it: an embedded peer with explicit endpoints, no
//! scouting, no router.
//!
//! Publishing uses `Block`: transport-level dropping loses large messages silently (zenoh #2258). Newest-wins is the
//! subscriber's ring of one: `put` takes 1.3 ms beside a subscriber of 100 ms a frame (default FIFO: 101 ms).
//! `low_latency` delivers no message of this size, shared memory loses frames of stalled subscribers (zenoh #2628).

use crate::compute::Pool;
use crate::frames::exposure_to_wire;
use crate::frames::{
    BoxFuture, BusError, CameraKey, Exposure, FrameBus, FramePublisher, FrameSubscription, Packet,
};
use crate::neighbours::Neighbours;
use crate::queue::latest;
use crate::seal::{KeyRing, Sealer, Unsealing};
use std::path::Path;
use std::sync::Arc;
use tokio::sync::watch;
use tryon::camera::Calibration;
use tryon_proto::v1::FrameKey;
use zenoh::Wait;
use zenoh::handlers::RingChannel;
use zenoh::qos::CongestionControl;
use zenoh::sample::{Locality, SampleKind};

/// Time that a stalled peer may block the others [µs]; then its connection is closed and reopened. zenoh's default of
/// 5 s freezes every screen.
const WAIT_BEFORE_CLOSE_US: u32 = 300_000;
/// Silence after which a connection counts as dead (ms).
const LEASE_MS: u32 = 2_000;
/// First and longest pause between attempts to connect (ms): a restarted peer is found within a second.
const RETRY_MS: (u32, u32) = (100, 500);

fn fault(e: impl std::fmt::Display) -> BusError {
    BusError(e.to_string())
}

/// Peer on the bus.
pub struct ZenohBus {
    session: zenoh::Session,
    pool: Arc<Pool>,
    keys: Arc<KeyRing>,
    neighbours: Arc<Neighbours>,
}

impl ZenohBus {
    /// Opens the peer without TLS and access control.
    ///
    /// # Errors
    /// As [`Self::open_with`].
    pub async fn open(
        listen: &[String],
        connect: &[String],
        pool: Arc<Pool>,
    ) -> Result<Arc<Self>, BusError> {
        Self::open_with(Path::new(""), listen, connect, pool).await
    }

    /// Opens the peer with the certificates and access control of a file of zenoh (JSON5); an empty path for none.
    /// Endpoints are `tcp/ADDRESS:PORT`, `tls/HOST:PORT` or `unixsock-stream/PATH`; those to connect to may come up later.
    /// Requires a multi-threaded runtime.
    ///
    /// # Errors
    /// Names the file that is unusable, or the endpoint that is malformed or cannot be listened on.
    pub async fn open_with(
        file: &Path,
        listen: &[String],
        connect: &[String],
        pool: Arc<Pool>,
    ) -> Result<Arc<Self>, BusError> {
        let mut c = if file.as_os_str().is_empty() {
            zenoh::Config::default()
        } else {
            zenoh::Config::from_file(file)
                .map_err(|e| BusError(format!("{}: {e}", file.display())))?
        };
        // A router hands frames on to clients; between peers it needs the gossip that is off here.
        let is_behind_router = !file.as_os_str().is_empty() && listen.is_empty();
        let mode = if is_behind_router { "client" } else { "peer" };
        let list = |l: &[String]| format!("{l:?}");
        let (init, max) = RETRY_MS;
        let retry =
            format!("{{period_init_ms: {init}, period_max_ms: {max}, period_increase_factor: 2}}");
        let settings = [
            ("mode", format!("\"{mode}\"")),
            ("listen/endpoints", list(listen)),
            ("connect/endpoints", list(connect)),
            ("connect/timeout_ms", "-1".into()),
            ("connect/exit_on_failure", "false".into()),
            ("connect/retry", retry),
            ("scouting/multicast/enabled", "false".into()),
            ("scouting/gossip/enabled", "false".into()),
            ("transport/link/tx/lease", LEASE_MS.to_string()),
            (
                "transport/link/tx/queue/congestion_control/block/wait_before_close",
                WAIT_BEFORE_CLOSE_US.to_string(),
            ),
        ];
        for (key, value) in &settings {
            c.insert_json5(key, value)
                .map_err(|e| BusError(format!("{key} = {value}: {e}")))?;
        }
        let session = zenoh::open(c).await.map_err(fault)?;
        Ok(Arc::new(Self {
            session,
            pool,
            keys: Arc::default(),
            neighbours: Arc::default(),
        }))
    }
    /// Leaves the bus.
    pub async fn close(&self) {
        if let Err(e) = self.session.close().await {
            tracing::debug!(error = %e, "closing the bus");
        }
    }
}

/// Endpoint `tcp/127.0.0.1:PORT` on a port that is free now; zenoh does not report the port it got for port 0.
///
/// # Errors
/// When the system has no free port.
pub fn free_tcp_endpoint() -> std::io::Result<String> {
    let port = std::net::TcpListener::bind(("127.0.0.1", 0))?
        .local_addr()?
        .port();
    Ok(format!("tcp/127.0.0.1:{port}"))
}

struct ZenohPublisher {
    key: CameraKey,
    frames: Arc<zenoh::pubsub::Publisher<'static>>,
    pool: Arc<Pool>,
    neighbours: Arc<Neighbours>,
    _calibration: zenoh::query::Queryable<()>,
    _alive: zenoh::liveliness::LivelinessToken,
}

impl FramePublisher for ZenohPublisher {
    fn send(
        &mut self,
        exposure: Arc<Exposure>,
        sealer: Arc<Sealer>,
    ) -> BoxFuture<'_, Result<(), BusError>> {
        self.neighbours.send(&self.key, &exposure);
        Box::pin(async move {
            let matching = self.frames.matching_status().await;
            if matching.is_ok_and(|others| !others.matching()) {
                return Ok(());
            }
            let key = self.key.clone();
            let pack = move || {
                let message = exposure_to_wire(&exposure).map_err(|e| e.to_string())?;
                sealer.seal(&key, &message).map_err(|e| e.to_string())
            };
            let bytes = self.pool.run(pack).await.map_err(fault)?.map_err(fault)?;
            let frames = self.frames.clone();
            // `put` may block on a stalled peer: not on an async worker.
            tokio::task::spawn_blocking(move || frames.put(bytes).wait())
                .await
                .map_err(fault)?
                .map_err(fault)
        })
    }
}

impl FrameBus for ZenohBus {
    fn publish(
        &self,
        key: &CameraKey,
        calibration: &Calibration,
    ) -> BoxFuture<'_, Result<Box<dyn FramePublisher>, BusError>> {
        let key = key.clone();
        let answer = tryon_proto::convert::geometry::calibration_to_wire(calibration);
        let answer = tryon_proto::Message::encode_to_vec(&answer);
        Box::pin(async move {
            let frames = self
                .session
                .declare_publisher(key.rgbd())
                .allowed_destination(Locality::Remote)
                .congestion_control(CongestionControl::Block);
            let frames = Arc::new(frames.await.map_err(fault)?);
            let name = key.calibration();
            let reply = move |q: zenoh::query::Query| {
                if let Err(e) = q.reply(q.key_expr().clone(), answer.clone()).wait() {
                    tracing::debug!(error = %e, "a calibration query went unanswered");
                }
            };
            let calibration = self
                .session
                .declare_queryable(name)
                .callback(reply)
                .await
                .map_err(fault)?;
            let alive = self
                .session
                .liveliness()
                .declare_token(key.alive())
                .await
                .map_err(fault)?;
            let p = ZenohPublisher {
                key,
                frames,
                pool: self.pool.clone(),
                neighbours: self.neighbours.clone(),
                _calibration: calibration,
                _alive: alive,
            };
            Ok(Box::new(p) as Box<dyn FramePublisher>)
        })
    }

    fn subscribe(&self, key: &CameraKey) -> BoxFuture<'_, Result<FrameSubscription, BusError>> {
        let key = key.clone();
        Box::pin(async move {
            let ring = self
                .session
                .declare_subscriber(key.rgbd())
                .allowed_origin(Locality::Remote)
                .with(RingChannel::new(1))
                .await
                .map_err(fault)?;
            let (tx, packets) = latest::channel();
            let tx = Arc::new(tx);
            self.neighbours.add(&key, &tx);
            let pump = tokio::spawn(async move {
                while let Ok(sample) = ring.recv_async().await {
                    let payload = sample.payload().to_bytes().into_owned();
                    if !tx.send(Packet::Sealed(payload)) {
                        return;
                    }
                }
            });
            let (set_alive, alive) = watch::channel(false);
            let on_liveliness = move |s: zenoh::sample::Sample| {
                set_alive.send_replace(s.kind() == SampleKind::Put);
            };
            let life = self
                .session
                .liveliness()
                .declare_subscriber(key.alive())
                .history(true)
                .callback(on_liveliness);
            let life = life.await.map_err(fault)?;
            let guard = Box::new((AbortOnDrop(pump), life));
            Ok(FrameSubscription::new(
                packets,
                alive,
                self.pool.clone(),
                Unsealing::new(self.keys.clone(), key),
                guard,
            ))
        })
    }

    fn learn(&self, camera: &CameraKey, key: &FrameKey) {
        self.keys.learn(camera, key);
    }
}

struct AbortOnDrop(tokio::task::JoinHandle<()>);

impl Drop for AbortOnDrop {
    fn drop(&mut self) {
        self.0.abort();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn frames_cross_processes_even_when_the_listener_comes_last() {
        let pool = Pool::new(1).expect("a thread");
        let endpoint = [free_tcp_endpoint().expect("a port")];
        let late = ZenohBus::open(&[], &endpoint, pool.clone())
            .await
            .expect("opens before its peer");
        let camera = ZenohBus::open(&endpoint, &[], pool).await.expect("listens");
        crate::frames::tests::fulfils_the_contract(camera.as_ref(), late.as_ref()).await;
        // Within one process too, beside subscribers in others.
        crate::frames::tests::fulfils_the_contract(camera.as_ref(), camera.as_ref()).await;
        late.close().await;
        camera.close().await;
    }
}
