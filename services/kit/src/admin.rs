//! Admin port: `/metrics` for Prometheus, `/healthz` (the process lives), `/readyz` (it accepts work), `/readyz/all` (and
//! so do the services behind it).

use axum::Router;
use axum::extract::State;
use axum::routing::get;
use http::StatusCode;
use std::net::SocketAddr;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_server::Health;
use tonic_health::server::{HealthReporter, HealthService};
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
}

async fn readyz(State(probes): State<Probes>) -> (StatusCode, &'static str) {
    if *probes.ready.borrow() {
        (StatusCode::OK, "ready\n")
    } else {
        (StatusCode::SERVICE_UNAVAILABLE, "not ready\n")
    }
}

/// A line for each service that this port knows; 503 unless all of them serve.
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

/// Serves the admin port until `shutdown` and returns the bound address.
///
/// # Errors
/// When the address cannot be bound.
pub async fn serve(
    address: SocketAddr,
    ready: watch::Receiver<bool>,
    health: HealthReporter,
    shutdown: CancellationToken,
) -> std::io::Result<SocketAddr> {
    let listener = TcpListener::bind(address).await?;
    let bound = listener.local_addr()?;
    let _ = crate::telemetry::metrics();
    let app = Router::new()
        .route("/metrics", get(metrics_page))
        .route("/healthz", get(|| async { "alive\n" }))
        .route("/readyz", get(readyz))
        .route("/readyz/all", get(readyz_all))
        .with_state(Probes { ready, health });
    tokio::spawn(async move {
        tokio::select! {
            r = async { axum::serve(listener, app).await } => {
                if let Err(e) = r {
                    tracing::error!(error = %e, "the admin port failed");
                }
            }
            () = shutdown.cancelled() => {}
        }
    });
    Ok(bound)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tonic_health::ServingStatus as Status;

    #[tokio::test]
    async fn a_dead_service_behind_is_told_by_its_name() {
        let health = HealthReporter::new();
        let (_keep, ready) = watch::channel(true);
        let probes = || {
            State(Probes {
                ready: ready.clone(),
                health: health.clone(),
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
}
