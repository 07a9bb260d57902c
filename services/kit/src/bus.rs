//! Frame bus between processes over zenoh, the only module that names it beside `services/capture/src/ros2`, whose cameras
//! have a network of their own: explicit endpoints, no scouting.
//!
//! The capture process is a peer that listens. Everybody else is a client, one session for each endpoint: a router hands
//! frames on to clients, but between peers only with the gossip that is off here, and a capture process takes both.
//!
//! Publishing uses `Block`: transport-level dropping loses large messages silently (zenoh #2258). Newest-wins is the
//! subscriber's ring of one: `put` takes 1.3 ms beside a subscriber of 100 ms a frame (default FIFO: 101 ms).
//! `low_latency` delivers no message of this size, shared memory loses frames of stalled subscribers (zenoh #2628).

mod settings;

pub use settings::{Ends, check, client_elsewhere};

use crate::compute::Pool;
use crate::frames::exposure_to_wire;
use crate::frames::{
    BoxFuture, BusError, CameraKey, Exposure, FrameBus, FramePublisher, FrameSubscription, Packet,
};
use crate::neighbours::Neighbours;
use crate::queue::latest;
use crate::seal::{KeyRing, Sealer, Unsealing};
use settings::settings;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::watch;
use tryon_geometry::camera::Calibration;
use tryon_proto::v1::FrameKey;
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::handlers::RingChannel;
use zenoh::qos::CongestionControl;
use zenoh::sample::{Locality, SampleKind};

/// Pause after a session that cannot be opened.
const AFTER_FAULT: Duration = Duration::from_millis(500);

fn fault(e: impl std::fmt::Display) -> BusError {
    BusError(e.to_string())
}

/// Member of the bus.
pub struct ZenohBus {
    /// A listening peer, or a client of each endpoint.
    members: Vec<Member>,
    pool: Arc<Pool>,
    keys: Arc<KeyRing>,
    neighbours: Arc<Neighbours>,
}

impl ZenohBus {
    /// Joins without TLS and access control.
    ///
    /// # Errors
    /// As [`Self::join`].
    pub async fn open(
        listen: &[String],
        connect: &[String],
        pool: Arc<Pool>,
    ) -> Result<Arc<Self>, BusError> {
        let ends = Ends {
            listen,
            connect,
            identity: None,
            file: Path::new(""),
        };
        Self::join(&ends, pool).await
    }

    /// Joins. Those to connect to, capture processes or routers, may come up later.
    /// Requires a multi-threaded runtime.
    ///
    /// # Errors
    /// Names the file that is unusable, or the endpoint that is malformed or cannot be listened on.
    pub async fn join(ends: &Ends<'_>, pool: Arc<Pool>) -> Result<Arc<Self>, BusError> {
        let base = ends.base()?;
        let mut members = Vec::new();
        if !ends.listen.is_empty() {
            let session = zenoh::open(settings(base.clone(), "peer", ends.listen, &[])?);
            members.push(Member::open(session.await.map_err(fault)?));
        }
        for endpoint in ends.connect {
            let endpoint = std::slice::from_ref(endpoint);
            members.push(Member::opening(settings(
                base.clone(),
                "client",
                &[],
                endpoint,
            )?));
        }
        Ok(Arc::new(Self {
            members,
            pool,
            keys: Arc::default(),
            neighbours: Arc::default(),
        }))
    }
    /// Leaves the bus.
    pub async fn close(&self) {
        for member in &self.members {
            member.close().await;
        }
    }
}

/// Session of zenoh. A client's opens once its endpoint answers.
struct Member {
    session: watch::Receiver<Option<zenoh::Session>>,
    _opening: Option<AbortOnDrop>,
}

impl Member {
    fn open(session: zenoh::Session) -> Self {
        Self {
            session: watch::channel(Some(session)).1,
            _opening: None,
        }
    }

    fn opening(config: zenoh::Config) -> Self {
        let (opened, session) = watch::channel(None);
        let opening = tokio::spawn(async move {
            loop {
                match zenoh::open(config.clone()).await {
                    Ok(s) => return drop(opened.send_replace(Some(s))),
                    Err(e) => tracing::warn!(error = %e, "cannot join the bus yet"),
                }
                tokio::time::sleep(AFTER_FAULT).await;
            }
        });
        Self {
            session,
            _opening: Some(AbortOnDrop(opening)),
        }
    }

    async fn close(&self) {
        let session = self.session.borrow().clone();
        if let Some(session) = session
            && let Err(e) = session.close().await
        {
            tracing::debug!(error = %e, "closing the bus");
        }
    }
}

/// The session, once it is open.
async fn opened(
    mut session: watch::Receiver<Option<zenoh::Session>>,
) -> Result<zenoh::Session, BusError> {
    let opened = session.wait_for(Option::is_some).await.map_err(fault)?;
    opened.clone().ok_or_else(|| BusError("closed".into()))
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

/// Sessions in which a camera is alive.
struct Life {
    seen_in: Mutex<BTreeSet<usize>>,
    set_alive: watch::Sender<bool>,
}

impl Life {
    fn change(&self, session: usize, is_alive: bool) {
        let mut seen_in = self.seen_in.lock().unwrap_or_else(PoisonError::into_inner);
        if is_alive {
            seen_in.insert(session);
        } else {
            seen_in.remove(&session);
        }
        self.set_alive.send_replace(!seen_in.is_empty());
    }
}

/// A camera published in one session.
struct Line {
    frames: Arc<zenoh::pubsub::Publisher<'static>>,
    _calibration: zenoh::query::Queryable<()>,
    _alive: zenoh::liveliness::LivelinessToken,
}

impl Line {
    async fn open(
        session: &zenoh::Session,
        key: &CameraKey,
        calibration: Vec<u8>,
    ) -> Result<Self, BusError> {
        let frames = session
            .declare_publisher(key.rgbd())
            .allowed_destination(Locality::Remote)
            .congestion_control(CongestionControl::Block);
        let reply = move |q: zenoh::query::Query| {
            if let Err(e) = q.reply(q.key_expr().clone(), calibration.clone()).wait() {
                tracing::debug!(error = %e, "a calibration query went unanswered");
            }
        };
        let answers = session.declare_queryable(key.calibration()).callback(reply);
        Ok(Self {
            frames: Arc::new(frames.await.map_err(fault)?),
            _calibration: answers.await.map_err(fault)?,
            _alive: (session.liveliness().declare_token(key.alive()))
                .await
                .map_err(fault)?,
        })
    }

    /// Somebody subscribes, as far as is known.
    async fn is_wanted(&self) -> bool {
        let matching = self.frames.matching_status().await;
        !matching.is_ok_and(|others| !others.matching())
    }
}

/// A camera that is followed in one session.
struct Followed {
    key: CameraKey,
    queue: Arc<latest::Sender<Packet>>,
    /// Number of the session.
    number: usize,
    life: Arc<Life>,
}

impl Followed {
    /// Queues frames, and tells whether the camera is alive, from the moment in which the session is open.
    async fn follow(self, session: watch::Receiver<Option<zenoh::Session>>) {
        let key = self.key.clone();
        if let Err(e) = self.pump(session).await {
            tracing::error!(camera = %key, error = %e, "cannot subscribe");
        }
    }

    async fn pump(self, session: watch::Receiver<Option<zenoh::Session>>) -> Result<(), BusError> {
        let session = opened(session).await?;
        let ring = session
            .declare_subscriber(self.key.rgbd())
            .allowed_origin(Locality::Remote)
            .with(RingChannel::new(1))
            .await
            .map_err(fault)?;
        let (number, life) = (self.number, self.life);
        let on_liveliness = move |s: zenoh::sample::Sample| {
            life.change(number, s.kind() == SampleKind::Put);
        };
        let life = session
            .liveliness()
            .declare_subscriber(self.key.alive())
            .history(true)
            .callback(on_liveliness);
        let _life = life.await.map_err(fault)?;
        while let Ok(sample) = ring.recv_async().await {
            let payload = sample.payload().to_bytes().into_owned();
            if !self.queue.send(Packet::Sealed(payload)) {
                break;
            }
        }
        Ok(())
    }
}

struct ZenohPublisher {
    key: CameraKey,
    lines: Vec<Line>,
    pool: Arc<Pool>,
    neighbours: Arc<Neighbours>,
}

impl FramePublisher for ZenohPublisher {
    fn send(
        &mut self,
        exposure: Arc<Exposure>,
        sealer: Arc<Sealer>,
    ) -> BoxFuture<'_, Result<bool, BusError>> {
        let has_neighbours = self.neighbours.send(&self.key, &exposure);
        Box::pin(async move {
            let mut wanted = Vec::new();
            for line in &self.lines {
                if line.is_wanted().await {
                    wanted.push(line.frames.clone());
                }
            }
            if wanted.is_empty() {
                return Ok(has_neighbours);
            }
            let key = self.key.clone();
            let pack = move || {
                let message = exposure_to_wire(&exposure).map_err(|e| e.to_string())?;
                sealer.seal(&key, &message).map_err(|e| e.to_string())
            };
            let bytes = self.pool.run(pack).await.map_err(fault)?.map_err(fault)?;
            // `put` may block on a stalled peer: not on an async worker.
            let bytes = ZBytes::from(bytes);
            let put = move || (wanted.iter()).try_for_each(|f| f.put(bytes.clone()).wait());
            let put = tokio::task::spawn_blocking(put);
            put.await.map_err(fault)?.map_err(fault)?;
            Ok(true)
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
            let mut lines = Vec::new();
            for member in &self.members {
                let session = opened(member.session.clone()).await?;
                lines.push(Line::open(&session, &key, answer.clone()).await?);
            }
            let p = ZenohPublisher {
                key,
                lines,
                pool: self.pool.clone(),
                neighbours: self.neighbours.clone(),
            };
            Ok(Box::new(p) as Box<dyn FramePublisher>)
        })
    }

    fn subscribe(&self, key: &CameraKey) -> BoxFuture<'_, Result<FrameSubscription, BusError>> {
        let key = key.clone();
        Box::pin(async move {
            let (tx, packets) = latest::channel();
            let tx = Arc::new(tx);
            self.neighbours.add(&key, &tx);
            let (set_alive, alive) = watch::channel(false);
            let life = Arc::new(Life {
                seen_in: Mutex::default(),
                set_alive,
            });
            let follow = |(k, member): (usize, &Member)| {
                let camera = Followed {
                    key: key.clone(),
                    queue: tx.clone(),
                    number: k,
                    life: life.clone(),
                };
                AbortOnDrop(tokio::spawn(camera.follow(member.session.clone())))
            };
            let followed: Vec<_> = self.members.iter().enumerate().map(follow).collect();
            let guard = Box::new((followed, tx, life));
            let keys = Unsealing::new(self.keys.clone(), key);
            Ok(FrameSubscription::new(
                packets,
                alive,
                self.pool.clone(),
                keys,
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
    use crate::config::{BusConfig, Config};
    use crate::identity::{Authority, Identity};

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

    #[test]
    fn malformed_endpoints_are_named_by_their_key() {
        assert!(check(&BusConfig::default()).is_ok());
        let bad = || vec!["127.0.0.1:7447".to_owned()];
        let listen = BusConfig {
            listen: bad(),
            ..BusConfig::default()
        };
        let connect = BusConfig {
            connect: bad(),
            ..BusConfig::default()
        };
        for (config, key) in [(listen, "bus.listen"), (connect, "bus.connect")] {
            let e = check(&config).expect_err("no protocol").to_string();
            assert!(e.starts_with(key) && e.contains("127.0.0.1:7447"), "{e}");
        }
    }

    /// Identity of a service of the store.
    fn identity(authority: &Path, name: &str) -> Identity {
        let mut config = Config::default();
        config.identity.authority = authority.to_owned();
        let identity = Identity::of(&config, name, false).expect("random");
        identity.expect("a file is given")
    }

    fn ends<'a>(identity: &'a Identity, listen: &'a [String], connect: &'a [String]) -> Ends<'a> {
        Ends {
            listen,
            connect,
            identity: Some(identity),
            file: Path::new(""),
        }
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn frames_cross_the_shipped_router() {
        let dir = tempfile::tempdir().expect("a folder");
        let authority = dir.path().join("authority.pem");
        let made = Authority::open(&authority).expect("made");
        let leaf = made
            .issue("router", &["127.0.0.1".to_owned()])
            .expect("a name");
        for (name, text) in [
            ("ca.pem", &leaf.authorities),
            ("certificate.pem", &leaf.certificate),
            ("key.pem", &*leaf.key),
        ] {
            std::fs::write(dir.path().join(name), text).expect("written");
        }
        let free = || free_tcp_endpoint().expect("a port").replace("tcp/", "tls/");
        let [at_camera, at_router] = [(); 2].map(|()| free());
        let shipped = include_str!("../../../deploy/zenoh/router.json5")
            .replace("tls/0.0.0.0:7447", &at_router)
            .replace("tls/capture:7447", &at_camera)
            .replace("/etc/tryon/bus", &dir.path().display().to_string());
        let at_router = [at_router];
        let pool = Pool::new(1).expect("a thread");
        let own = identity(&authority, "tracking");
        let reader = ZenohBus::join(&ends(&own, &[], &at_router), pool.clone()).await;
        let reader = reader.expect("opens before the router");
        let own = identity(&authority, "capture");
        let camera = ZenohBus::join(&ends(&own, &[at_camera], &[]), pool).await;
        let camera = camera.expect("listens");
        let router = zenoh::Config::from_json5(&shipped).expect("a configuration");
        let router = zenoh::open(router).await.expect("a router");
        crate::frames::tests::fulfils_the_contract(camera.as_ref(), reader.as_ref()).await;

        // Of another store: the router lets nobody in.
        let theirs = identity(&dir.path().join("theirs.pem"), "tracking");
        let mut stranger = settings(
            ends(&theirs, &[], &at_router).base().expect("usable"),
            "client",
            &[],
            &at_router,
        )
        .expect("a configuration");
        for (key, value) in [("timeout_ms", "1000"), ("exit_on_failure", "true")] {
            let key = format!("connect/{key}");
            stranger.insert_json5(&key, value).expect("a setting");
        }
        assert!(
            zenoh::open(stranger).await.is_err(),
            "a stranger is on the bus"
        );
        reader.close().await;
        camera.close().await;
        router.close().await.expect("closes");
    }
}
