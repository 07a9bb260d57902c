//! Servers: health and reflection beside the service, limits and keepalive, an end with a deadline.

use crate::compute::Pool;
use crate::drain::{Drained, until_deadline};
use crate::frames::FrameBus;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio_stream::wrappers::TcpListenerStream;
use tokio_util::sync::CancellationToken;
use tonic::service::{Routes, RoutesBuilder};
use tonic::transport::Server;
use tonic_health::ServingStatus;
use tonic_health::server::HealthReporter;

/// Time that a call may take until its headers or answer; streams run on.
const CALL_TIMEOUT: Duration = Duration::from_secs(10);
/// Clients that vanish without a word are noticed after these two.
const PING_EVERY: Duration = Duration::from_secs(5);
const PING_TIMEOUT: Duration = Duration::from_secs(5);
/// Streams on one connection. A kiosk needs three, a page six.
const MAX_STREAMS: u32 = 64;
/// Headers of our clients take 1 kB.
const MAX_HEADER_BYTES: u32 = 16 * 1024;
/// Requests are names and numbers; what needs more says so at its service.
pub const MAX_REQUEST_BYTES: usize = 64 * 1024;
/// Beyond `grace`, what a handler needs to see the signal and end its streams by itself.
const CUT: Duration = Duration::from_millis(250);

/// What a service needs from the process that runs it.
#[derive(Clone)]
pub struct Context {
    /// Where frames travel.
    pub bus: Arc<dyn FrameBus>,
    /// Where computing happens.
    pub pool: Arc<Pool>,
    /// Cancelled when the process should end.
    pub shutdown: CancellationToken,
    /// What open streams have to finish.
    pub grace: Duration,
}

/// A service that could not start, or broke.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// An address could not be bound.
    #[error("{key} = {address}: {source}")]
    Bind {
        /// Configuration key.
        key: String,
        /// Its value.
        address: SocketAddr,
        /// What the system said.
        source: std::io::Error,
    },
    /// A configured value turned out unusable.
    #[error("{key}: {why}")]
    Config {
        /// Configuration key.
        key: String,
        /// What is wrong.
        why: String,
    },
    /// The bus could not be joined.
    #[error(transparent)]
    Bus(#[from] crate::frames::BusError),
    /// The server broke while running.
    #[error("{service}: {why}")]
    Broken {
        /// Which service.
        service: &'static str,
        /// How.
        why: String,
    },
}

/// How a service ended.
pub type Outcome = Drained;

/// A running service.
#[derive(Debug)]
pub struct Running {
    /// Its name.
    pub name: &'static str,
    /// Where its gRPC is.
    pub address: SocketAddr,
    /// Where its metrics and probes are.
    pub admin: SocketAddr,
    task: JoinHandle<Result<Outcome, StartError>>,
}

impl Running {
    /// Waits for its end.
    ///
    /// # Errors
    /// When it broke.
    pub async fn ended(self) -> Result<Outcome, StartError> {
        let name = self.name;
        self.task.await.unwrap_or_else(|e| {
            Err(StartError::Broken {
                service: name,
                why: e.to_string(),
            })
        })
    }
}

/// Routes with health and reflection in place.
pub fn routes() -> Result<(RoutesBuilder, HealthReporter), StartError> {
    let reporter = HealthReporter::new();
    let health = tonic_health::pb::health_server::HealthServer::new(
        tonic_health::server::HealthService::from_health_reporter(reporter.clone()),
    );
    let reflection = tonic_reflection::server::Builder::configure()
        .register_encoded_file_descriptor_set(tryon_proto::DESCRIPTOR)
        .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
        .build_v1()
        .map_err(|e| StartError::Config {
            key: "reflection".into(),
            why: e.to_string(),
        })?;
    let mut builder = Routes::builder();
    builder.add_service(health).add_service(reflection);
    Ok((builder, reporter))
}

/// What [`start`] needs to know about a service.
pub struct Service {
    /// Its name, as in the configuration: `tracking`.
    pub name: &'static str,
    /// Its gRPC name: `tryon.v1.TrackingService`.
    pub grpc_name: &'static str,
    /// Where to listen.
    pub address: SocketAddr,
    /// Where the admin port listens.
    pub admin: SocketAddr,
    /// Its routes.
    pub routes: Routes,
    /// Speaks HTTP/1.1 too, for browsers.
    pub http1: bool,
    /// Reports its health.
    pub health: HealthReporter,
}

/// Binds both ports and serves until `ctx.shutdown`, then at most `ctx.grace` longer.
///
/// # Errors
/// When an address cannot be bound.
pub async fn start(service: Service, ctx: &Context) -> Result<Running, StartError> {
    let Service {
        name,
        grpc_name,
        address,
        admin,
        routes,
        http1,
        health,
    } = service;
    let bind = |key: &'static str, address| {
        move |source| StartError::Bind {
            key: format!("{name}.{key}"),
            address,
            source,
        }
    };
    let listener = TcpListener::bind(address)
        .await
        .map_err(bind("address", address))?;
    let bound = listener.local_addr().map_err(bind("address", address))?;
    let (ready, is_ready) = watch::channel(true);
    // The admin port lives as long as the service itself, so that probes can watch it drain.
    let ended = CancellationToken::new();
    let admin = crate::admin::serve(admin, is_ready, ended.clone())
        .await
        .map_err(bind("admin", admin))?;
    health
        .set_service_status(grpc_name, ServingStatus::Serving)
        .await;
    let server = Server::builder()
        .accept_http1(http1)
        .timeout(CALL_TIMEOUT)
        .tcp_nodelay(true)
        .http2_keepalive_interval(Some(PING_EVERY))
        .http2_keepalive_timeout(Some(PING_TIMEOUT))
        .http2_max_header_list_size(MAX_HEADER_BYTES)
        .max_concurrent_streams(MAX_STREAMS)
        .add_routes(routes);
    let (shutdown, grace) = (ctx.shutdown.clone(), ctx.grace);
    let task = tokio::spawn(async move {
        let signalled = shutdown.clone();
        let stop = async move {
            signalled.cancelled().await;
            ready.send_replace(false);
            health
                .set_service_status(grpc_name, ServingStatus::NotServing)
                .await;
        };
        let work = server.serve_with_incoming_shutdown(TcpListenerStream::new(listener), stop);
        let end = until_deadline(work, shutdown, grace + CUT).await;
        ended.cancel();
        end.map_err(|e| StartError::Broken {
            service: name,
            why: format!("{e}: {:?}", std::error::Error::source(&e)),
        })
    });
    tracing::info!(service = name, address = %bound, %admin, "serving");
    Ok(Running {
        name,
        address: bound,
        admin,
        task,
    })
}
