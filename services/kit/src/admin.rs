//! Admin port: `/metrics` for Prometheus, `/healthz` (the process lives), `/readyz` (it accepts work), `/readyz/all` (and
//! so do the services behind it, and nothing that somebody waits for stands still).
//!
//! Other machines may have the first and the last only as the process's calls: with a token where it asks for tokens,
//! through TLS where it has a certificate. The other two say nothing and stay open and plain, for an orchestrator. This
//! machine may have all of them.

use crate::auth::Auth;
use crate::connections::{self, Limits};
use crate::flow::Stalls;
use crate::tls::Tls;
use crate::transport::{self, IsEncrypted};
use axum::Router;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::IntoResponse;
use axum::routing::get;
use http::{Response, StatusCode};
use std::net::SocketAddr;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;
use tonic::transport::server::TcpConnectInfo;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_server::Health;
use tonic_health::server::{HealthReporter, HealthService};
use tower::ServiceExt;
use tryon_proto::v1::{
    capture_service_server, cloth_service_server, compositor_service_server,
    tracking_service_server,
};

/// gRPC names of all services; a port reports its own and those behind it.
const SERVICES: [&str; 4] = [
    capture_service_server::SERVICE_NAME,
    tracking_service_server::SERVICE_NAME,
    cloth_service_server::SERVICE_NAME,
    compositor_service_server::SERVICE_NAME,
];

/// State of the probes.
#[derive(Clone)]
struct Probes {
    ready: watch::Receiver<bool>,
    health: HealthReporter,
    stalls: Stalls,
}

async fn readyz(State(probes): State<Probes>) -> (StatusCode, &'static str) {
    if *probes.ready.borrow() {
        (StatusCode::OK, "ready\n")
    } else {
        (StatusCode::SERVICE_UNAVAILABLE, "not ready\n")
    }
}

/// A line for each service that this port knows and for each flow that stands still; 503 unless all serve and flow.
async fn readyz_all(State(probes): State<Probes>) -> (StatusCode, String) {
    let health = HealthService::from_health_reporter(probes.health.clone());
    let mut status = StatusCode::OK;
    let mut text = String::new();
    for name in SERVICES {
        let question = HealthCheckRequest {
            service: name.into(),
        };
        let Ok(answer) = health.check(tonic::Request::new(question)).await else {
            continue;
        };
        let serves = answer.get_ref().status() == ServingStatus::Serving;
        if !serves {
            status = StatusCode::SERVICE_UNAVAILABLE;
        }
        let state = if serves { "serves" } else { "does not serve" };
        text += &format!("{name} {state}\n");
    }
    for line in probes.stalls.lines() {
        status = StatusCode::SERVICE_UNAVAILABLE;
        text += &format!("stands still: {line}\n");
    }
    (status, text)
}

async fn metrics_page() -> (StatusCode, String) {
    match crate::telemetry::metrics() {
        Some(handle) => {
            handle.run_upkeep();
            (StatusCode::OK, handle.render())
        }
        None => (
            StatusCode::SERVICE_UNAVAILABLE,
            "another recorder is installed\n".into(),
        ),
    }
}

/// Requests of other machines for what tells about the process.
#[derive(Clone)]
struct Guard {
    /// Routes behind the gate of tokens.
    guarded: Router,
    has_tls: bool,
}

/// Passes requests of this machine on, and puts those of others through the gate.
async fn guard(State(guard): State<Guard>, request: Request, next: Next) -> Response<Body> {
    if is_local(&request) {
        return next.run(request).await;
    }
    let is_encrypted = request.extensions().get() == Some(&IsEncrypted(true));
    if guard.has_tls && !is_encrypted {
        return (StatusCode::FORBIDDEN, "https is needed\n").into_response();
    }
    let Ok(mut answer) = guard.guarded.oneshot(request).await;
    // Refusals of the gate are those of gRPC.
    let refusal = answer.headers().get("grpc-status").map(|s| s.as_bytes());
    *answer.status_mut() = match refusal {
        None => answer.status(),
        Some(b"16") => StatusCode::UNAUTHORIZED,
        Some(_) => StatusCode::FORBIDDEN,
    };
    answer
}

/// A request from this machine.
fn is_local(request: &Request) -> bool {
    let info = request.extensions().get::<TcpConnectInfo>();
    let peer = info.and_then(TcpConnectInfo::remote_addr);
    peer.is_some_and(|p| p.ip().to_canonical().is_loopback())
}

/// An admin port.
pub struct Admin {
    /// Service that it is about, which tokens name as their audience.
    pub service: &'static str,
    /// Address to bind.
    pub address: SocketAddr,
    /// The service accepts work.
    pub ready: watch::Receiver<bool>,
    /// Health of the service and of those behind it.
    pub health: HealthReporter,
    /// Flows of the process that stand still.
    pub stalls: Stalls,
    /// Tokens that its callers need.
    pub auth: Auth,
    /// Encryption of connections.
    pub tls: Tls,
}

impl Admin {
    /// Serves until `shutdown` and returns the bound address.
    ///
    /// # Errors
    /// When the address cannot be bound.
    pub async fn serve(self, shutdown: CancellationToken) -> std::io::Result<SocketAddr> {
        let listener = TcpListener::bind(self.address).await?;
        let bound = listener.local_addr()?;
        let _ = crate::telemetry::metrics();
        let (routes, tls) = (self.routes(), self.tls);
        let incoming = connections::accept(listener, Limits::of_probes());
        tokio::spawn(async move {
            let ended = shutdown.clone();
            tokio::select! {
                () = transport::serve_mixed(incoming, routes, &tls, ended.cancelled()) => {}
                () = crate::telemetry::fold_samples() => {}
                () = shutdown.cancelled() => {}
            }
        });
        Ok(bound)
    }

    fn routes(&self) -> Router {
        let probes = Probes {
            ready: self.ready.clone(),
            health: self.health.clone(),
            stalls: self.stalls.clone(),
        };
        let telling = Router::new()
            .route("/metrics", get(metrics_page))
            .route("/readyz/all", get(readyz_all))
            .with_state(probes.clone());
        let guarded = Guard {
            guarded: self.auth.guard(self.service, telling.clone()),
            has_tls: self.tls.acceptor().is_some(),
        };
        Router::new()
            .route("/healthz", get(|| async { "alive\n" }))
            .route("/readyz", get(readyz))
            .with_state(probes)
            .merge(telling.route_layer(from_fn_with_state(guarded, guard)))
    }
}

/// Serves an open and plain admin port until `shutdown` and returns the bound address.
#[cfg(test)]
pub(crate) async fn serve(
    address: SocketAddr,
    ready: watch::Receiver<bool>,
    health: HealthReporter,
    shutdown: CancellationToken,
) -> std::io::Result<SocketAddr> {
    let admin = Admin {
        service: "",
        address,
        ready,
        health,
        stalls: Stalls::default(),
        auth: Auth::off(),
        tls: Tls::off(),
    };
    admin.serve(shutdown).await
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auth::Issuer;
    use crate::config::Config;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::net::TcpStream;
    use tonic_health::ServingStatus as Status;

    #[tokio::test]
    async fn a_dead_service_behind_is_told_by_its_name() {
        let health = HealthReporter::new();
        let (_keep, ready) = watch::channel(true);
        let stalls = Stalls::default();
        let probes = || {
            State(Probes {
                ready: ready.clone(),
                health: health.clone(),
                stalls: stalls.clone(),
            })
        };
        let [_, tracking, _, compositor] = SERVICES;
        health.set_service_status(compositor, Status::Serving).await;
        health.set_service_status(tracking, Status::Serving).await;
        let (status, text) = readyz_all(probes()).await;
        assert_eq!((status, text.lines().count()), (StatusCode::OK, 2));

        health
            .set_service_status(tracking, Status::NotServing)
            .await;
        let (status, text) = readyz_all(probes()).await;
        assert_eq!(status, StatusCode::SERVICE_UNAVAILABLE);
        assert!(text.contains("TrackingService does not serve"), "{text}");
        assert_eq!(
            readyz(probes()).await.0,
            StatusCode::OK,
            "it still takes work"
        );
    }

    /// An admin port of cloth that asks for tokens of the issuer.
    fn admin(issuer: &Issuer) -> Admin {
        let config = Config::default();
        Admin {
            service: "cloth",
            address: "127.0.0.1:0".parse().expect("an address"),
            ready: watch::channel(true).1,
            health: HealthReporter::new(),
            stalls: Stalls::default(),
            auth: Auth::open(&config, Some(issuer)).expect("a key"),
            tls: Tls::off(),
        }
    }

    /// Status of a request from an address.
    async fn status(admin: &Admin, path: &str, peer: &str, token: Option<&str>) -> u16 {
        let mut request = Request::get(path);
        if let Some(token) = token {
            request = request.header("authorization", format!("Bearer {token}"));
        }
        let mut request = request.body(Body::empty()).expect("a request");
        request.extensions_mut().insert(TcpConnectInfo {
            local_addr: None,
            remote_addr: Some(peer.parse().expect("an address")),
        });
        let answer = admin.routes().oneshot(request).await.expect("infallible");
        answer.status().as_u16()
    }

    #[tokio::test]
    async fn another_machine_needs_a_token_for_what_tells_and_none_for_probes() {
        let issuer = Issuer::generate().expect("random");
        let admin = admin(&issuer);
        let store = Config::default().store().to_owned();
        let token = |service| {
            issuer
                .issue_for_process(&store, &[service])
                .expect("random")
        };
        let (good, other) = (token("cloth"), token("capture"));
        let (near, far) = ("[::ffff:127.0.0.1]:9", "192.0.2.1:9");
        for path in ["/healthz", "/readyz"] {
            assert_eq!(status(&admin, path, far, None).await, 200, "{path}");
        }
        for path in ["/metrics", "/readyz/all"] {
            // Another test may have installed a recorder.
            let served = [200, 503];
            assert!(
                served.contains(&status(&admin, path, near, None).await),
                "{path}"
            );
            assert!(
                served.contains(&status(&admin, path, far, Some(&good)).await),
                "{path}"
            );
            assert_eq!(status(&admin, path, far, None).await, 401, "{path}");
            assert_eq!(status(&admin, path, far, Some("x")).await, 401, "{path}");
            assert_eq!(status(&admin, path, far, Some(&other)).await, 403, "{path}");
        }
        assert_eq!(status(&admin, "/", far, None).await, 404);
    }

    /// First line of the answer to `GET path`.
    async fn get_line(address: SocketAddr, path: &str) -> String {
        let mut stream = TcpStream::connect(address).await.expect("connects");
        let request = format!("GET {path} HTTP/1.0\r\n\r\n");
        stream.write_all(request.as_bytes()).await.expect("sent");
        let mut answer = String::new();
        let _ = stream.read_to_string(&mut answer).await;
        answer.lines().next().unwrap_or_default().to_owned()
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn silent_sockets_end_for_a_probe() {
        let end = CancellationToken::new();
        let admin = admin(&Issuer::generate().expect("random"));
        let address = admin.serve(end.clone()).await.expect("bound");
        let mut silent = Vec::new();
        for _ in 0..400 {
            silent.push(TcpStream::connect(address).await.expect("connects"));
        }
        let begun = std::time::Instant::now();
        assert!(get_line(address, "/healthz").await.ends_with("200 OK"));
        assert!(begun.elapsed() < std::time::Duration::from_secs(1));
        let is_held = |s: &TcpStream| {
            let read = s.try_read(&mut [0]);
            read.is_err_and(|e| e.kind() == std::io::ErrorKind::WouldBlock)
        };
        tokio::time::sleep(std::time::Duration::from_millis(200)).await;
        let held = silent.iter().filter(|s| is_held(s)).count();
        assert!(held <= 32, "{held}");
        end.cancel();
    }
}
