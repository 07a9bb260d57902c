//! Deadlines of calls: that of the service, or a shorter one which the caller names (`grpc-timeout`).

use axum::body::Body;
use axum::extract::Request;
use axum::middleware::Next;
use http::{HeaderMap, Response};
use std::time::Duration;
use tonic::Status;

/// Longest time of a call until its headers or answer; streams run on.
const CALL_TIMEOUT: Duration = Duration::from_secs(10);

/// Ends a call that has no answer within its deadline with DEADLINE_EXCEEDED.
pub(crate) async fn within_deadline(request: Request, next: Next) -> Response<Body> {
    let named = named(request.headers()).unwrap_or(CALL_TIMEOUT);
    match tokio::time::timeout(named.min(CALL_TIMEOUT), next.run(request)).await {
        Ok(response) => response,
        Err(_) => Status::deadline_exceeded("the call took too long").into_http(),
    }
}

/// Deadline in the headers of a call: up to eight digits and a unit; `None` without one that can be read.
fn named(headers: &HeaderMap) -> Option<Duration> {
    let text = headers.get("grpc-timeout")?.to_str().ok()?;
    let (digits, unit) = text.split_at_checked(text.len().checked_sub(1)?)?;
    if digits.len() > 8 || !digits.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let count: u64 = digits.parse().ok()?;
    Some(match unit {
        "H" => Duration::from_secs(count * 3600),
        "M" => Duration::from_secs(count * 60),
        "S" => Duration::from_secs(count),
        "m" => Duration::from_millis(count),
        "u" => Duration::from_micros(count),
        "n" => Duration::from_nanos(count),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadlines_are_read_as_the_protocol_says() {
        let read = |text: &str| {
            let mut headers = HeaderMap::new();
            headers.insert("grpc-timeout", text.parse().expect("ASCII"));
            named(&headers)
        };
        assert_eq!(read("250m"), Some(Duration::from_millis(250)));
        assert_eq!(
            read("99999999H"),
            Some(Duration::from_secs(99_999_999 * 3600))
        );
        for bad in ["", "S", "-1S", "100000000S", "1x", "1 S", "٣S"] {
            let mut headers = HeaderMap::new();
            let value = http::HeaderValue::from_bytes(bad.as_bytes()).expect("visible");
            headers.insert("grpc-timeout", value);
            assert_eq!(named(&headers), None, "{bad}");
        }
    }
}
