//! Admin port: `/metrics` for Prometheus, `/healthz` (the process lives), `/readyz` (it accepts work).

use axum::Router;
use axum::extract::State;
use axum::routing::get;
use http::StatusCode;
use std::net::SocketAddr;
use tokio::net::TcpListener;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

async fn readyz(State(ready): State<watch::Receiver<bool>>) -> (StatusCode, &'static str) {
    if *ready.borrow() {
        (StatusCode::OK, "ready\n")
    } else {
        (StatusCode::SERVICE_UNAVAILABLE, "not ready\n")
    }
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
    shutdown: CancellationToken,
) -> std::io::Result<SocketAddr> {
    let listener = TcpListener::bind(address).await?;
    let bound = listener.local_addr()?;
    let _ = crate::telemetry::metrics();
    let app = Router::new()
        .route("/metrics", get(metrics_page))
        .route("/healthz", get(|| async { "alive\n" }))
        .route("/readyz", get(readyz))
        .with_state(ready);
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
