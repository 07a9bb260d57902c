//! Requests that are no message of their type: INVALID_ARGUMENT, the caller's fault. tonic answers INTERNAL, as gRPC's
//! list of codes suggests, which alerts would count as ours and clients would try again.

use http::{HeaderValue, Response};

/// Header of the status, and its values for INTERNAL and INVALID_ARGUMENT.
const STATUS: (&str, &str, &str) = ("grpc-status", "13", "3");
/// Start of prost's message as it is encoded in the header.
const FAULT: &[u8] = b"failed%20to%20decode%20Protobuf%20message";

/// The answer with the right code, if it is that of an undecodable request.
pub(crate) fn blame_caller<B>(mut answer: Response<B>) -> Response<B> {
    let (name, internal, invalid) = STATUS;
    let headers = answer.headers_mut();
    let is_internal = headers.get(name).is_some_and(|s| s == internal);
    let message = headers.get("grpc-message").map(HeaderValue::as_bytes);
    if is_internal && message.is_some_and(|m| m.starts_with(FAULT)) {
        headers.insert(name, HeaderValue::from_static(invalid));
    }
    answer
}

#[cfg(test)]
mod tests {
    use super::*;
    use tonic::body::Body;
    use tower::util::MapResponseLayer;
    use tower::{Layer, ServiceExt};

    /// Status of a call to health with this message.
    async fn status(message: &'static [u8]) -> String {
        let (routes, _) = crate::server::routes("tryon.v1.CaptureService").expect("known");
        let service = MapResponseLayer::new(blame_caller).layer(routes.routes());
        let request = http::Request::post("/grpc.health.v1.Health/Check")
            .header("content-type", "application/grpc")
            .body(Body::new(axum::body::Body::from(message)))
            .expect("a request");
        let answer = service.oneshot(request).await.expect("an answer");
        let status = answer.headers().get("grpc-status").cloned();
        status.map_or("in trailers".into(), |s| {
            s.to_str().expect("a number").into()
        })
    }

    #[tokio::test]
    async fn undecodable_requests_are_the_callers_fault() {
        assert_eq!(status(b"\0\0\0\0\x02\x0a\x7f").await, "3");
        assert_eq!(status(b"\0\0\0\0\0").await, "in trailers");
        assert_eq!(
            status(b"\0\0\0\0\x03\x0a\x01x").await,
            "5",
            "an unknown name"
        );
    }
}
