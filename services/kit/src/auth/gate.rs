//! Layer in front of every service: asks for a token before anything of a message is decoded.

use super::authority::Authority;
use super::claims::Claims;
use super::ending::Ending;
use super::grant::{Grant, denied};
use super::revocation::Revocations;
use super::{Fault, unix_s};
use crate::connections::Seat;
use axum::Router;
use axum::body::Body;
use axum::extract::State;
use axum::middleware::{Next, from_fn_with_state};
use http::{HeaderMap, Request, Response, header};
use std::sync::Arc;
use std::time::Duration;
use tonic::Status;

/// Probes carry no token.
const HEALTH: &str = "/grpc.health.v1.Health/";
/// The one call that is made before a caller has a token; its handler asks for a code.
const REDEEM: &str = "/tryon.v1.CompositorService/RedeemCode";
/// Longest sleep until a token's end: a later one is slept for again (timers of hundreds of years overflow).
const LONGEST_SLEEP: Duration = Duration::from_secs(24 * 3600);

#[derive(Clone)]
struct Gate {
    authority: Option<Arc<Authority>>,
    service: &'static str,
}

/// Puts the gate of a service in front of its routes.
pub(super) fn guard(
    authority: Option<Arc<Authority>>,
    service: &'static str,
    routes: Router,
) -> Router {
    routes.layer(from_fn_with_state(Gate { authority, service }, pass))
}

/// Passes a request on with its [`Grant`], or answers with UNAUTHENTICATED or PERMISSION_DENIED. A connection is proven
/// once a token was valid on it; where no tokens are asked for, once a call was answered.
async fn pass(State(gate): State<Gate>, mut request: Request<Body>, next: Next) -> Response<Body> {
    let seat = request.extensions().get::<Arc<Seat>>().cloned();
    let prove = || seat.iter().for_each(|s| s.prove());
    let Some(authority) = gate.authority else {
        request.extensions_mut().insert(Grant::everything());
        let answer = next.run(request).await;
        prove();
        return answer;
    };
    let judged = judge(&authority, gate.service, &request);
    if is_open(&request) {
        judged.iter().for_each(|_| prove());
        request.extensions_mut().insert(Grant::nothing());
        return next.run(request).await;
    }
    match judged {
        Ok(claims) => {
            prove();
            let end = end(claims.clone(), authority.revoked());
            request.extensions_mut().insert(Grant::of_token(claims));
            let answer = next.run(request).await;
            answer.map(|body| Body::new(Ending::new(body, end)))
        }
        Err(status) => {
            let code = format!("{:?}", status.code());
            metrics::counter!("tryon_refused_calls", "service" => gate.service, "code" => code)
                .increment(1);
            status.into_http()
        }
    }
}

/// Claims of a request that cover it.
fn judge<B>(
    authority: &Authority,
    service: &str,
    request: &Request<B>,
) -> Result<Arc<Claims>, Status> {
    let unauthenticated = |f: Fault| Status::unauthenticated(f.to_string());
    let token = bearer(request.headers()).map_err(unauthenticated)?;
    let seat = request.extensions().get::<Arc<Seat>>();
    let claims = authority
        .authenticate(token, seat.map(AsRef::as_ref))
        .map_err(unauthenticated)?;
    let method = request.uri().path().rsplit('/').next().unwrap_or_default();
    match authority.refusal(&claims, service, method) {
        Some(claim) => Err(denied(claim)),
        None => Ok(claims),
    }
}

/// A call that needs no token.
fn is_open<B>(request: &Request<B>) -> bool {
    let has_credentials = request.headers().contains_key(header::AUTHORIZATION);
    let path = request.uri().path();
    path.starts_with(HEALTH) || (path == REDEEM && !has_credentials)
}

/// Token of the one `authorization: Bearer TOKEN` (RFC 6750, 2.1).
fn bearer(headers: &HeaderMap) -> Result<&str, Fault> {
    let mut values = headers.get_all(header::AUTHORIZATION).iter();
    let (Some(value), None) = (values.next(), values.next()) else {
        return Err(Fault::Missing);
    };
    let value = value.to_str().map_err(|_| Fault::Malformed)?;
    let (scheme, token) = value.split_once(' ').ok_or(Fault::Missing)?;
    if scheme.eq_ignore_ascii_case("bearer") {
        Ok(token.trim())
    } else {
        Err(Fault::Missing)
    }
}

/// Waits for the end of a token; its reason.
async fn end(claims: Arc<Claims>, mut revoked: Revocations) -> &'static str {
    let expiry = async {
        loop {
            let left = Duration::from_secs(claims.exp.saturating_sub(unix_s()));
            if left.is_zero() {
                return;
            }
            tokio::time::sleep(left.min(LONGEST_SLEEP)).await;
        }
    };
    tokio::select! {
        () = expiry => "the token has expired",
        () = revoked.of(&claims.jti) => "the token was revoked",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::auth::Issuer;
    use axum::routing::any;
    use tower::ServiceExt;

    const CALL: &str = "/tryon.v1.ClothService/Dress";

    /// Guarded routes that answer with the reach of the request, and the issuer of their tokens.
    fn guarded() -> (Router, Issuer) {
        let issuer = Issuer::generate().expect("random");
        let keys = vec![issuer.public()];
        let authority = Authority::new(keys, "store".into(), Revocations::none());
        let answer = any(|request: Request<Body>| async move {
            let grant = request.extensions().get::<Grant>().cloned();
            format!("{}", grant.expect("passed the gate").is_nothing())
        });
        let routes = Router::new().fallback(answer);
        (guard(authority.map(Arc::new), "cloth", routes), issuer)
    }

    /// `grpc-status` of a refusal, or the answer of the routes.
    async fn answer(routes: &Router, path: &str, authorizations: &[&str]) -> String {
        answer_on(&Seat::alone(), routes, path, authorizations).await
    }

    /// The same on a connection.
    async fn answer_on(
        seat: &Arc<Seat>,
        routes: &Router,
        path: &str,
        authorizations: &[&str],
    ) -> String {
        let mut request = Request::post(path);
        for value in authorizations {
            request = request.header("authorization", *value);
        }
        let request = request.extension(seat.clone());
        let request = request.body(Body::empty()).expect("a request");
        let answer = routes.clone().oneshot(request).await.expect("infallible");
        if let Some(status) = answer.headers().get("grpc-status") {
            return status.to_str().expect("a number").to_owned();
        }
        let body = axum::body::to_bytes(answer.into_body(), 64).await;
        String::from_utf8_lossy(&body.expect("short")).into_owned()
    }

    #[tokio::test]
    async fn one_bearer_token_that_covers_the_call_passes() {
        let (routes, issuer) = guarded();
        let token = |service: &str| {
            let token = issuer.issue_for_process("store", &[service]);
            format!("Bearer {}", token.expect("random"))
        };
        let good = token("cloth");
        let lower = good.replace("Bearer", "bearer ");
        assert_eq!(answer(&routes, CALL, &[&good]).await, "false");
        assert_eq!(answer(&routes, CALL, &[&lower]).await, "false");
        assert_eq!(answer(&routes, CALL, &[&token("capture")]).await, "7");
        let basic = good.replace("Bearer", "Basic");
        let long = format!("Bearer {}", "a".repeat(10_000));
        let refused: [&[&str]; 7] = [
            &[],
            &[""],
            &["Bearer"],
            &["Bearer "],
            &[&basic],
            &[&long],
            &[&good, &good],
        ];
        for headers in refused {
            assert_eq!(answer(&routes, CALL, headers).await, "16", "{headers:?}");
        }
    }

    #[tokio::test]
    async fn health_and_the_trade_of_codes_need_no_token() {
        let (routes, _) = guarded();
        let health = "/grpc.health.v1.Health/Check";
        for (path, headers, expected) in [
            (health, &[][..], "true"),
            (health, &["Bearer x"], "true"),
            (REDEEM, &[], "true"),
            (REDEEM, &["Bearer x"], "16"),
            ("/grpc.health.v1.Healthy/Check", &[], "16"),
            (
                "/grpc.reflection.v1.ServerReflection/ServerReflectionInfo",
                &[],
                "16",
            ),
            ("/", &[], "16"),
            ("//grpc.health.v1.Health/Check", &[], "16"),
        ] {
            assert_eq!(answer(&routes, path, headers).await, expected, "{path}");
        }
    }

    #[tokio::test]
    async fn a_connection_is_proven_by_a_good_token_and_by_nothing_else() {
        let (routes, issuer) = guarded();
        let health = "/grpc.health.v1.Health/Check";
        let good = issuer.issue_for_process("store", &["cloth"]);
        let good = format!("Bearer {}", good.expect("random"));
        for (path, token, expected) in [
            (health, None, false),
            (health, Some("Bearer x"), false),
            (CALL, None, false),
            (CALL, Some("Bearer x"), false),
            (CALL, Some(good.as_str()), true),
            (health, Some(good.as_str()), true),
        ] {
            let seat = Seat::alone();
            let token: Vec<_> = token.into_iter().collect();
            answer_on(&seat, &routes, path, &token).await;
            assert_eq!(seat.is_proven(), expected, "{path} {token:?}");
        }
        let open = guard(None, "cloth", Router::new().fallback(any(|| async {})));
        let seat = Seat::alone();
        answer_on(&seat, &open, CALL, &[]).await;
        assert!(seat.is_proven(), "no tokens are asked for");
    }

    #[tokio::test]
    async fn without_keys_everything_passes() {
        let open = guard(
            None,
            "cloth",
            Router::new().fallback(any(|| async { "open" })),
        );
        assert_eq!(answer(&open, CALL, &[]).await, "open");
    }
}
