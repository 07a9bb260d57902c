//! The services of one box in one process, each on a runtime and a bus peer of its own, so that one can be killed.

use std::net::SocketAddr;
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use tokio_util::sync::CancellationToken;
use tonic::Streaming;
use tonic::transport::Channel;
use tryon_kit::auth::Auth;
use tryon_kit::bus::{ZenohBus, free_tcp_endpoint};
use tryon_kit::config::CameraConfig;
use tryon_kit::flow::Stalls;
use tryon_kit::server::{Context, Outcome, Running, StartError};
use tryon_kit::tls::Tls;
use tryon_kit::{Config, Pool};
use tryon_proto::v1::compositor_service_client::CompositorServiceClient;
use tryon_proto::v1::stream_frames_response::Event;
use tryon_proto::v1::*;

/// A service of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    Capture,
    Tracking,
    Cloth,
    Compositor,
}

/// All services, upstream first.
pub const PARTS: [Part; 4] = [Part::Capture, Part::Tracking, Part::Cloth, Part::Compositor];

/// One service on a runtime of its own.
struct Process {
    runtime: Runtime,
    running: Running,
    shutdown: CancellationToken,
}

/// Configuration and processes of one box.
pub struct Kiosk {
    pub config: Config,
    processes: Vec<Option<Process>>,
}

impl Kiosk {
    /// Starts all four, with a camera `front` on `source`, and `side` on the test pattern.
    pub fn start(source: &str, rate: f64) -> Self {
        Self::with(source, rate, |_| {})
    }

    /// The same with other settings.
    pub fn with(source: &str, rate: f64, change: impl FnOnce(&mut Config)) -> Self {
        let mut config = Config::default();
        let any: SocketAddr = "127.0.0.1:0".parse().expect("an address");
        let endpoint = vec![free_tcp_endpoint().expect("a free port")];
        (config.bus.listen, config.bus.connect) = (endpoint.clone(), endpoint);
        config.process.grace_ms = 1000;
        config.process.compute_threads = 2;
        // Tests share their machine: whatever else runs on it must not thin cloth or refuse try-ons.
        (config.cloth.adapts_detail, config.compositor.by_capacity) = (false, false);
        let camera = |name: &str, source: &str, rate| CameraConfig {
            name: name.into(),
            source: source.into(),
            rate,
            ..CameraConfig::default()
        };
        config.capture.cameras = vec![
            camera("front", source, rate),
            camera("side", "pattern", 10.0),
        ];
        for a in [
            &mut config.capture.address,
            &mut config.capture.admin,
            &mut config.tracking.address,
            &mut config.tracking.admin,
            &mut config.cloth.address,
            &mut config.cloth.admin,
            &mut config.compositor.address,
            &mut config.compositor.admin,
        ] {
            *a = any;
        }
        change(&mut config);
        let mut kiosk = Self {
            config,
            processes: vec![None, None, None, None],
        };
        PARTS.into_iter().for_each(|p| kiosk.restart(p));
        kiosk
    }

    /// Starts a part, on its earlier address if it had one.
    pub fn restart(&mut self, part: Part) {
        let config = self.config.clone();
        let shutdown = CancellationToken::new();
        // On a thread of its own: the caller may be inside a runtime.
        let begin = || {
            let begun = Instant::now();
            loop {
                match Self::run(part, config.clone(), shutdown.clone()) {
                    Ok(started) => return started,
                    // The port of a part that was killed may be in use for a moment.
                    Err(StartError::Bind { .. }) if begun.elapsed() < Duration::from_secs(2) => {
                        #[allow(
                            clippy::disallowed_methods,
                            reason = "a plain thread of a test waits for a port"
                        )]
                        std::thread::sleep(Duration::from_millis(20));
                    }
                    Err(e) => panic!("{part:?}: {e}"),
                }
            }
        };
        let (runtime, running) = std::thread::scope(|s| s.spawn(begin).join()).expect("starts");
        let url = format!("http://{}", running.address);
        match part {
            Part::Capture => {
                self.config.capture.address = running.address;
                self.config.compositor.capture = url;
            }
            Part::Tracking => {
                self.config.tracking.address = running.address;
                (self.config.cloth.tracking, self.config.compositor.tracking) = (url.clone(), url);
            }
            Part::Cloth => {
                self.config.cloth.address = running.address;
                self.config.compositor.cloth = url;
            }
            Part::Compositor => self.config.compositor.address = running.address,
        }
        self.processes[part as usize] = Some(Process {
            runtime,
            running,
            shutdown,
        });
    }

    fn run(
        part: Part,
        config: Config,
        token: CancellationToken,
    ) -> Result<(Runtime, Running), StartError> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .expect("a runtime");
        let running = runtime.block_on(async move {
            let pool = Pool::new(config.process.compute_threads).expect("threads");
            let (listen, connect) = match part {
                Part::Capture => (&config.bus.listen[..], &[][..]),
                _ => (&[][..], &config.bus.connect[..]),
            };
            let bus = ZenohBus::open(listen, connect, pool.clone())
                .await
                .expect("a bus");
            let ctx = Context {
                stalls: Stalls::default(),
                bus,
                pool,
                shutdown: token,
                grace: Duration::from_millis(config.process.grace_ms),
                auth: Auth::open(&config, None)?,
                tls: Tls::open(&config.tls)?,
                inside: Tls::inside(&config, None)?,
            };
            match part {
                Part::Capture => tryon_capture_service::start(&config, ctx).await,
                Part::Tracking => tryon_tracking_service::start(&config, ctx).await,
                Part::Cloth => tryon_cloth_service::start(&config, ctx).await,
                Part::Compositor => tryon_compositor_service::start(&config, ctx).await,
            }
        });
        match running {
            Ok(r) => Ok((runtime, r)),
            Err(e) => {
                runtime.shutdown_background();
                Err(e)
            }
        }
    }

    /// Ends every task and connection of the part at once, as SIGKILL does.
    pub fn kill(&mut self, part: Part) {
        if let Some(p) = self.processes[part as usize].take() {
            p.runtime.shutdown_background();
        }
    }

    /// Drains the part, as SIGTERM does; its end and the time that took.
    pub fn stop(&mut self, part: Part) -> (Outcome, Duration) {
        let p = self.processes[part as usize].take().expect("runs");
        let end = move || {
            let begun = Instant::now();
            p.shutdown.cancel();
            let outcome = p.runtime.block_on(p.running.ended()).expect("ends");
            let took = begun.elapsed();
            p.runtime.shutdown_timeout(Duration::from_millis(100));
            (outcome, took)
        };
        std::thread::scope(|s| s.spawn(end).join()).expect("ends")
    }

    /// Admin address of a running part.
    pub fn admin(&self, part: Part) -> SocketAddr {
        self.processes[part as usize]
            .as_ref()
            .expect("runs")
            .running
            .admin
    }

    /// Connection to a part.
    pub fn channel(&self, part: Part) -> Channel {
        let address = match part {
            Part::Capture => self.config.capture.address,
            Part::Tracking => self.config.tracking.address,
            Part::Cloth => self.config.cloth.address,
            Part::Compositor => self.config.compositor.address,
        };
        tryon_kit::client::channel(&format!("http://{address}"), &Tls::off()).expect("a URL")
    }

    /// Client of the compositor.
    pub fn compositor(&self) -> CompositorServiceClient<Channel> {
        CompositorServiceClient::new(self.channel(Part::Compositor))
    }
}

impl Drop for Kiosk {
    fn drop(&mut self) {
        PARTS.into_iter().for_each(|p| self.kill(p));
    }
}

/// Choices of garments in size M.
pub fn wear(garments: &[&str]) -> Vec<GarmentChoice> {
    garments
        .iter()
        .map(|g| GarmentChoice {
            garment: (*g).into(),
            size: "M".into(),
            color_rgb: None,
            print: None,
        })
        .collect()
}

/// A viewer of one try-on.
pub struct Watcher {
    pub events: Streaming<StreamFramesResponse>,
}

/// Longest wait for any event, far beyond the promised times because tests share their machine. The tests of those times
/// assert them.
pub const PATIENCE: Duration = Duration::from_secs(150);

impl Watcher {
    /// Opens the try-on and watches it, with retries while the compositor is away.
    pub async fn open(kiosk: &Kiosk, id: &str, camera: &str, garments: &[&str]) -> Self {
        let begun = Instant::now();
        loop {
            match Self::try_open(kiosk, id, camera, garments).await {
                Ok(w) => return w,
                Err(s) if begun.elapsed() < PATIENCE => {
                    assert_eq!(s.code(), tonic::Code::Unavailable, "{s}");
                    tokio::time::sleep(Duration::from_millis(50)).await;
                }
                Err(s) => panic!("{s}"),
            }
        }
    }

    async fn try_open(
        kiosk: &Kiosk,
        id: &str,
        camera: &str,
        garments: &[&str],
    ) -> Result<Self, tonic::Status> {
        let mut c = kiosk.compositor();
        let r = OpenTryOnRequest {
            try_on_id: id.into(),
            store: String::new(),
            camera: camera.into(),
            garments: wear(garments),
            consent: Some(Consent { given: true }),
        };
        c.open_try_on(r).await?;
        let r = StreamFramesRequest {
            try_on_id: id.into(),
            width: 320,
            height: 240,
            ..Default::default()
        };
        Ok(Self {
            events: c.stream_frames(r).await?.into_inner(),
        })
    }

    /// The next event; `Err` is the status with which the stream ended, OK for a regular end.
    pub async fn next(&mut self) -> Result<Event, tonic::Status> {
        let next = tokio::time::timeout(PATIENCE, self.events.message())
            .await
            .expect("the stream went silent");
        let message = next?.ok_or_else(|| tonic::Status::ok("the end"))?;
        Ok(message.event.expect("an event"))
    }

    /// Reads until an event that is `wanted`.
    pub async fn until(&mut self, what: &str, wanted: impl Fn(&Event) -> bool) -> Event {
        let begun = Instant::now();
        let mut last = String::new();
        loop {
            let e = self
                .next()
                .await
                .unwrap_or_else(|s| panic!("the stream ended before {what}: {s}; last {last}"));
            if wanted(&e) {
                return e;
            }
            last = match &e {
                Event::Picture(p) => format!("picture {:?} {:?}", p.state(), p.reason()),
                Event::Status(s) => format!("status {:?} {:?} {}", s.state(), s.reason(), s.detail),
            };
            assert!(
                begun.elapsed() < PATIENCE,
                "waited too long for {what}; last {last}"
            );
        }
    }

    /// Reads until a picture that is `wanted`.
    pub async fn picture_where(
        &mut self,
        what: &str,
        wanted: impl Fn(&Picture) -> bool,
    ) -> Picture {
        let is = |e: &Event| matches!(e, Event::Picture(p) if wanted(p));
        let Event::Picture(p) = self.until(what, is).await else {
            unreachable!("just matched")
        };
        p
    }

    /// Reads until a picture in `state`.
    pub async fn picture(&mut self, state: TryOnState) -> Picture {
        self.picture_where(state.as_str_name(), |p| p.state() == state)
            .await
    }

    /// Reads until a status that is degraded for `reason`.
    pub async fn degraded(&mut self, reason: DegradedReason) -> TryOnStatus {
        let is = |e: &Event| matches!(e, Event::Status(s) if s.state() == TryOnState::Degraded && s.reason() == reason);
        let Event::Status(s) = self.until(reason.as_str_name(), is).await else {
            unreachable!("just matched")
        };
        s
    }
}
