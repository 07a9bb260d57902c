//! The four services of one box in one process, each restarted when it breaks.

use anyhow::{Context as _, Result};
use std::future::Future;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;
use tryon_kit::auth::{Connection, Credentials, Issuer};
use tryon_kit::client::{channel, pauses};
use tryon_kit::compute::Pool;
use tryon_kit::config::{CameraConfig, Config};
use tryon_kit::flow::Stalls;
use tryon_kit::frame_trace;
use tryon_kit::frames::{FrameBus, LocalBus};
use tryon_kit::process::{Check, CommonFiles};
use tryon_kit::server::{Context, Running, StartError};
use tryon_kit::tls::Tls;

type Starting = Pin<Box<dyn Future<Output = Result<Running, StartError>> + Send>>;
type Start = fn(Arc<Config>, Context) -> Starting;

/// Name and start of each service, upstream first.
const SERVICES: [(&str, Start); 4] = [
    ("capture", |c, x| {
        Box::pin(async move { tryon_capture_service::start(&c, x).await })
    }),
    ("tracking", |c, x| {
        Box::pin(async move { tryon_tracking_service::start(&c, x).await })
    }),
    ("cloth", |c, x| {
        Box::pin(async move { tryon_cloth_service::start(&c, x).await })
    }),
    ("compositor", |c, x| {
        Box::pin(async move { tryon_compositor_service::start(&c, x).await })
    }),
];

/// Check of each service's files.
const CHECKS: [Check; 4] = [
    tryon_capture_service::check,
    tryon_tracking_service::check,
    tryon_cloth_service::check,
    tryon_compositor_service::check,
];

/// Running services of one box.
pub(crate) struct OneBox {
    /// Addresses by service name.
    pub(crate) addresses: Vec<(&'static str, SocketAddr, SocketAddr)>,
    /// Token of the mirror's page. It and its key are drawn at each start; where `[auth] keys` are given, their holder
    /// issues the page's token.
    pub(crate) token: Option<String>,
    /// Token of the program that feeds a camera, by the camera's name; under the same keys.
    pub(crate) feeders: Vec<(String, String)>,
    /// `http` or `https`.
    scheme: &'static str,
    tls: Tls,
    shutdown: CancellationToken,
    tasks: JoinSet<()>,
    traces: Option<frame_trace::Exporter>,
}

/// Tokens of the programs that feed cameras.
fn feeder_tokens(config: &Config, issuer: &Issuer) -> Result<Vec<(String, String)>> {
    let fed = (config.capture.cameras.iter()).filter(|c| c.source == tryon_capture_service::PUSH);
    let token = |c: &CameraConfig| {
        let token = issuer.issue_for_feeder(config.store(), &c.name)?;
        Ok((c.name.clone(), token))
    };
    fed.map(token).collect()
}

impl OneBox {
    /// Opens all files that the box would. Needs a runtime.
    ///
    /// # Errors
    /// Names the key at fault.
    pub(crate) fn check(config: &Config) -> Result<()> {
        CommonFiles::open(config, "box", Some(&Issuer::generate()?))?;
        let mut config = config.clone();
        connect(&mut config);
        for check in CHECKS {
            check(&config)?;
        }
        Ok(())
    }
    /// Starts all services. Without `bus`, frames stay in this process. Ports may be 0: the bound ones are written into
    /// the configuration of the services that follow.
    ///
    /// # Errors
    /// Names the service and the address or key at fault.
    pub(crate) async fn start(mut config: Config, bus: Option<Arc<dyn FrameBus>>) -> Result<Self> {
        let issuer = Issuer::generate()?;
        let files = CommonFiles::open(&config, "box", Some(&issuer))?;
        let token = if config.auth.keys.is_empty() {
            Some(issuer.issue_for_process(config.store(), &["compositor"])?)
        } else {
            None
        };
        let feeders = if token.is_some() {
            feeder_tokens(&config, &issuer)?
        } else {
            Vec::new()
        };
        let pool = Pool::new(config.process.compute_threads)
            .context("the compute threads cannot be started")?;
        let bus = bus.unwrap_or_else(|| LocalBus::new(Arc::clone(&pool)));
        let shutdown = CancellationToken::new();
        let grace = Duration::from_millis(config.process.grace_ms);
        let ctx = Context {
            stalls: Stalls::default(),
            bus,
            pool,
            shutdown: shutdown.clone(),
            grace,
            auth: files.auth,
            tls: files.tls.clone(),
            inside: files.inside,
        };
        connect(&mut config);
        let traces = frame_trace::start("box", &config.telemetry);
        let traces = traces.map_err(|why| StartError::Config {
            key: "telemetry.otlp".into(),
            why,
        })?;
        let mut addresses = Vec::new();
        let mut tasks = JoinSet::new();
        for (name, start) in SERVICES {
            let running = start(Arc::new(config.clone()), ctx.clone())
                .await
                .with_context(|| name.to_owned())?;
            addresses.push((name, running.address, running.admin));
            pin_addresses(&mut config, name, &running);
            tasks.spawn(supervise(
                name,
                start,
                Arc::new(config.clone()),
                ctx.clone(),
                running,
            ));
        }
        Ok(Self {
            scheme: scheme(config.tls.is_server()),
            tls: files.tls,
            addresses,
            token,
            feeders,
            shutdown,
            tasks,
            traces,
        })
    }
    /// gRPC address of a service.
    pub(crate) fn address(&self, name: &str) -> Option<SocketAddr> {
        self.addresses.iter().find(|a| a.0 == name).map(|a| a.1)
    }
    /// Address of the mirror's page. The token is behind `#`, where no log and no referrer sees it.
    pub(crate) fn page(&self) -> Option<String> {
        let address = self.address("compositor")?;
        let token = self.token.as_ref();
        let fragment = token.map_or(String::new(), |t| format!("#token={t}"));
        Some(format!("{}://{address}/{fragment}", self.scheme))
    }
    /// Connection to the compositor, with the page's token.
    ///
    /// # Errors
    /// When it has no address.
    pub(crate) fn compositor(&self) -> Result<Connection> {
        let address = (self.address("compositor")).context("the compositor has no address")?;
        let url = format!("{}://{address}", self.scheme);
        let channel = channel(&url, &self.tls).map_err(anyhow::Error::msg)?;
        Ok(Credentials::fixed(self.token.as_deref().unwrap_or_default()).present(channel))
    }
    /// Drains all services; each has its own hard deadline.
    pub(crate) async fn stop(mut self) {
        self.shutdown.cancel();
        while self.tasks.join_next().await.is_some() {}
        if let Some(traces) = self.traces {
            traces.end().await;
        }
    }
}

/// Scheme of a service's URL.
fn scheme(is_encrypted: bool) -> &'static str {
    if is_encrypted { "https" } else { "http" }
}

/// Lets the services of the box call each other.
fn connect(config: &mut Config) {
    let scheme = scheme(!config.identity.off || config.tls.is_server());
    let url = |address| format!("{scheme}://{address}");
    config.compositor.capture = url(config.capture.address);
    config.compositor.tracking = url(config.tracking.address);
    config.compositor.cloth = url(config.cloth.address);
    config.cloth.tracking = url(config.tracking.address);
}

/// Replaces port 0 by the bound port, for the services that follow and for restarts.
fn pin_addresses(config: &mut Config, name: &str, running: &Running) {
    let (address, admin) = match name {
        "capture" => (&mut config.capture.address, &mut config.capture.admin),
        "tracking" => (&mut config.tracking.address, &mut config.tracking.admin),
        "cloth" => (&mut config.cloth.address, &mut config.cloth.admin),
        _ => (&mut config.compositor.address, &mut config.compositor.admin),
    };
    (*address, *admin) = (running.address, running.admin);
    connect(config);
}

/// Restarts a service whenever it breaks, after a pause that grows with each failure.
async fn supervise(
    name: &'static str,
    start: Start,
    config: Arc<Config>,
    ctx: Context,
    first: Running,
) {
    let mut running = Some(first);
    let mut waits = pauses();
    loop {
        if let Some(r) = running.take() {
            match r.ended().await {
                Ok(how) if ctx.shutdown.is_cancelled() => {
                    tracing::info!(service = name, ?how, "ended");
                    return;
                }
                Ok(_) => tracing::error!(service = name, "ended by itself; starting it again"),
                Err(e) => tracing::error!(service = name, error = %e, "broke; starting it again"),
            }
        }
        let pause = waits.next().unwrap_or(Duration::from_secs(1));
        tokio::select! {
            () = ctx.shutdown.cancelled() => return,
            () = tokio::time::sleep(pause) => {}
        }
        match start(Arc::clone(&config), ctx.clone()).await {
            Ok(r) => {
                running = Some(r);
                waits = pauses();
            }
            Err(e) => tracing::error!(service = name, error = %e, "cannot start"),
        }
    }
}
