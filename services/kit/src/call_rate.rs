//! Rate of calls of other machines: beyond an allowance calls are refused before a token is checked. A connection that
//! has proved itself has its own allowance, all others of an address share one.

use crate::connections::Seat;
use crate::peer_budget::{Allowance, PeerBudget};
use crate::status::too_often;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::middleware::Next;
use http::Response;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Instant;
use tonic::transport::server::TcpConnectInfo;

/// Calls of one address or of one proven connection: sixteen viewers behind one gateway acknowledge 30 pictures a second
/// each.
pub(crate) const ALLOWANCE: Allowance = Allowance {
    burst: 1000.0,
    per_second: 500.0,
};

/// Budget of the calls of one port.
pub(crate) fn budget() -> Arc<PeerBudget> {
    Arc::new(PeerBudget::new(ALLOWANCE))
}

/// Refuses a call beyond the allowance with RESOURCE_EXHAUSTED and RetryInfo. The first call of a connection always
/// passes, so that nobody behind the same address can spend the budget of a client before its token is checked. The
/// machine's own clients share its loopback address and have no limit.
pub(crate) async fn within_rate(
    State(budget): State<Arc<PeerBudget>>,
    request: Request,
    next: Next,
) -> Response<Body> {
    let now = Instant::now();
    if let Some(peer) = counted(&request) {
        let seat = request.extensions().get::<Arc<Seat>>();
        let is_within = seat.and_then(|s| s.take_call(now));
        if !is_within.unwrap_or_else(|| budget.take(peer, now)) {
            metrics::counter!("tryon_calls_too_often").increment(1);
            return too_often(ALLOWANCE.per_second).into_http();
        }
    }
    next.run(request).await
}

/// Address whose calls are counted; `None` for this machine's own.
fn counted(request: &Request) -> Option<IpAddr> {
    let info = request.extensions().get::<TcpConnectInfo>()?;
    let peer = info.remote_addr()?.ip().to_canonical();
    (!peer.is_loopback()).then_some(peer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::Router;
    use axum::middleware::from_fn_with_state;
    use axum::routing::any;
    use std::net::SocketAddr;
    use tower::ServiceExt;

    /// Number of `calls` at once from an address that are answered.
    async fn answered(routes: &Router, peer: &str, calls: usize) -> usize {
        answered_on(routes, peer, calls, None).await
    }

    /// The same on a connection.
    async fn answered_on(
        routes: &Router,
        peer: &str,
        calls: usize,
        seat: Option<&Arc<Seat>>,
    ) -> usize {
        let peer: SocketAddr = peer.parse().expect("an address");
        let mut answered = 0;
        for _ in 0..calls {
            let mut request = Request::post("/x").body(Body::empty()).expect("a request");
            request.extensions_mut().insert(TcpConnectInfo {
                local_addr: None,
                remote_addr: Some(peer),
            });
            if let Some(seat) = seat {
                request.extensions_mut().insert(seat.clone());
            }
            let answer = routes.clone().oneshot(request).await.expect("infallible");
            let code = answer.headers().get("grpc-status");
            assert!(code.is_none_or(|c| c == "8"), "{code:?}");
            answered += usize::from(code.is_none());
        }
        answered
    }

    #[tokio::test]
    async fn a_flood_is_refused_and_costs_nobody_else() {
        let routes = Router::new()
            .fallback(any(|| async { "fine" }))
            .layer(from_fn_with_state(budget(), within_rate));
        let flood = 4 * ALLOWANCE.burst as usize;
        let passed = answered(&routes, "10.0.0.1:1000", flood).await;
        assert!(passed >= ALLOWANCE.burst as usize, "{passed}");
        assert!(passed < flood, "{passed}");
        assert_eq!(answered(&routes, "10.0.0.2:1000", 100).await, 100);
        assert_eq!(answered(&routes, "127.0.0.1:1000", flood).await, flood);
    }

    #[tokio::test]
    async fn a_flood_of_an_address_leaves_its_new_and_its_proven_connections_alone() {
        let routes = Router::new()
            .fallback(any(|| async { "fine" }))
            .layer(from_fn_with_state(budget(), within_rate));
        let (peer, flood) = ("10.0.0.1:1000", 4 * ALLOWANCE.burst as usize);
        answered(&routes, peer, flood).await;
        let (proven, stranger) = (Seat::alone(), Seat::alone());
        assert_eq!(answered_on(&routes, peer, 1, Some(&proven)).await, 1);
        proven.prove();
        assert_eq!(answered_on(&routes, peer, 500, Some(&proven)).await, 500);
        let passed = answered_on(&routes, peer, flood, Some(&stranger)).await;
        assert!((1..flood / 2).contains(&passed), "{passed}");
        let passed = answered_on(&routes, peer, flood, Some(&proven)).await;
        assert!(passed < flood, "{passed}");
    }
}
