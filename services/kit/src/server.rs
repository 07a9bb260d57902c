//! gRPC servers: health and reflection beside the service, limits and keepalive, an end with a deadline.

use crate::admin::Admin;
use crate::auth::{Auth, AuthError};
use crate::call_rate::{self, within_rate};
use crate::compute::Pool;
use crate::connections::{self, Limits};
use crate::deadline::within_deadline;
use crate::drain::{Drained, until_deadline};
use crate::flow::Stalls;
use crate::frames::FrameBus;
use crate::tls::{Tls, TlsError};
use crate::transport;
use crate::undecodable::blame_caller;
use axum::Router;
use axum::middleware::{from_fn, from_fn_with_state};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;
use tonic::service::{Routes, RoutesBuilder};
use tonic_health::ServingStatus;
use tonic_health::server::HealthReporter;
use tower::util::MapResponseLayer;

/// Largest request, bytes: requests are names and numbers. A service with larger ones sets its own limit.
pub const MAX_REQUEST_BYTES: usize = 64 * 1024;
/// gRPC name of health.
const HEALTH: &str = "grpc.health.v1.Health";
/// Time beyond `grace` for handlers to see the signal and end their streams.
const CUT: Duration = Duration::from_millis(250);

/// Dependencies of a service on its process.
#[derive(Clone)]
pub struct Context {
    /// Frame bus.
    pub bus: Arc<dyn FrameBus>,
    /// Compute pool.
    pub pool: Arc<Pool>,
    /// Cancelled when the process should end.
    pub shutdown: CancellationToken,
    /// Time that open streams have to finish.
    pub grace: Duration,
    /// Who may call, and the process's own token.
    pub auth: Auth,
    /// Encryption of the port of browsers and kiosks, and of other machines' looks at figures.
    pub tls: Tls,
    /// Encryption of connections between services, made and accepted.
    pub inside: Tls,
    /// Flows that stand still.
    pub stalls: Stalls,
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
        /// Error of the system.
        source: std::io::Error,
    },
    /// A configured value turned out unusable.
    #[error("{key}: {why}")]
    Config {
        /// Configuration key.
        key: String,
        /// Fault.
        why: String,
    },
    /// A file of `[auth]` turned out unusable.
    #[error(transparent)]
    Auth(#[from] AuthError),
    /// A file of `[tls]` turned out unusable.
    #[error(transparent)]
    Tls(#[from] TlsError),
    /// The bus could not be joined.
    #[error(transparent)]
    Bus(#[from] crate::frames::BusError),
    /// The server broke while running.
    #[error("{service}: {why}")]
    Broken {
        /// Service at fault.
        service: &'static str,
        /// Fault.
        why: String,
    },
}

/// End of a service.
pub type Outcome = Drained;

/// A running service.
#[derive(Debug)]
pub struct Running {
    /// Its name.
    pub name: &'static str,
    /// gRPC address.
    pub address: SocketAddr,
    /// Address of metrics and probes.
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

/// Routes of the service of that gRPC name, with health and reflection in place.
///
/// # Errors
/// When the name is none of the contracts.
pub fn routes(grpc_name: &str) -> Result<(RoutesBuilder, HealthReporter), StartError> {
    let reporter = HealthReporter::new();
    let health = tonic_health::pb::health_server::HealthServer::new(
        tonic_health::server::HealthService::from_health_reporter(reporter.clone()),
    );
    // Only what this port answers is listed. Many tools still ask in v1alpha alone.
    let listed = || {
        tonic_reflection::server::Builder::configure()
            .register_encoded_file_descriptor_set(tryon_proto::DESCRIPTOR)
            .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
            .with_service_name(grpc_name)
            .with_service_name(HEALTH)
    };
    let fault = |e: tonic_reflection::server::Error| StartError::Config {
        key: "reflection".into(),
        why: e.to_string(),
    };
    let mut builder = Routes::builder();
    builder
        .add_service(health)
        .add_service(listed().build_v1().map_err(fault)?)
        .add_service(listed().build_v1alpha().map_err(fault)?);
    Ok((builder, reporter))
}

/// Layers and routes around guarded ones.
pub type Around = Box<dyn FnOnce(Router) -> Router + Send>;

/// Arguments of [`start`].
pub struct Service {
    /// Its name, as in the configuration: `tracking`.
    pub name: &'static str,
    /// Its gRPC name: `tryon.v1.TrackingService`.
    pub grpc_name: &'static str,
    /// gRPC address to bind.
    pub address: SocketAddr,
    /// Admin address to bind.
    pub admin: SocketAddr,
    /// Its routes; they are put behind the gate of `auth`.
    pub routes: Routes,
    /// Layers and routes around the gate, which see requests without a token.
    pub around: Option<Around>,
    /// Browsers and kiosks call it: it speaks HTTP/1.1 too, under the certificate of `[tls]`; others show the store's.
    pub is_public: bool,
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
        around,
        is_public,
        health,
    } = service;
    let guarded = ctx.auth.guard(name, routes.into_axum_router());
    let routes = Routes::from(match around {
        Some(around) => around(guarded),
        None => guarded,
    });
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
    // The admin port outlives the drain, so that probes can observe it.
    let ended = CancellationToken::new();
    let probes = Admin {
        service: name,
        address: admin,
        ready: is_ready,
        health: health.clone(),
        stalls: ctx.stalls.clone(),
        auth: ctx.auth.clone(),
        tls: ctx.tls.clone(),
    };
    let admin = (probes.serve(ended.clone()).await).map_err(bind("admin", admin))?;
    health
        .set_service_status(grpc_name, ServingStatus::Serving)
        .await;
    let router = (routes.prepare().into_axum_router())
        .layer(MapResponseLayer::new(blame_caller))
        .layer(from_fn(within_deadline))
        .layer(from_fn_with_state(call_rate::budget(), within_rate));
    let incoming = connections::accept(listener, Limits::default());
    let protocols = transport::Protocols {
        has_http1: is_public,
        tls: if is_public { &ctx.tls } else { &ctx.inside }.clone(),
    };
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
        let work = async {
            transport::serve(incoming, router, &protocols, stop).await;
            Ok(())
        };
        let end = until_deadline(work, shutdown, grace + CUT).await;
        ended.cancel();
        end
    });
    tracing::info!(service = name, address = %bound, %admin, "serving");
    Ok(Running {
        name,
        address: bound,
        admin,
        task,
    })
}
