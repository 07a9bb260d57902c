//! Errors for the wire: `google.rpc.Status` with details.

use std::time::Duration;
use tonic::{Code, Status};
use tonic_types::{ErrorDetails, StatusExt};

/// Retry delay after an upstream failed: the time within which a restarted service is up.
pub const RETRY_UPSTREAM: Duration = Duration::from_millis(500);
/// Retry delay after a limit was reached.
pub const RETRY_LIMIT: Duration = Duration::from_secs(5);

/// UNAVAILABLE with RetryInfo: `service` does not answer.
pub fn unavailable(service: &str, why: &str) -> Status {
    let details = ErrorDetails::with_retry_info(Some(RETRY_UPSTREAM));
    Status::with_error_details(Code::Unavailable, format!("{service}: {why}"), details)
}

/// RESOURCE_EXHAUSTED with RetryInfo: all `limit` places are taken.
pub fn exhausted(what: &str, limit: usize) -> Status {
    let details = ErrorDetails::with_retry_info(Some(RETRY_LIMIT));
    Status::with_error_details(
        Code::ResourceExhausted,
        format!("all {limit} {what} are in use"),
        details,
    )
}

/// RESOURCE_EXHAUSTED for a caller that calls too often, with its allowance.
pub(crate) fn too_often(per_second: f64) -> Status {
    let details = ErrorDetails::with_retry_info(Some(RETRY_LIMIT));
    let why = format!("more than {per_second} calls a second from one address");
    Status::with_error_details(Code::ResourceExhausted, why, details)
}

/// NOT_FOUND with kind and id.
pub fn not_found(what: &str, id: &str) -> Status {
    Status::not_found(format!("no {what} `{id}`"))
}

/// Failure of an upstream `service` for the downstream caller: faults of the arguments pass through, all others become
/// UNAVAILABLE.
pub fn from_upstream(service: &str, s: &Status) -> Status {
    match s.code() {
        Code::InvalidArgument
        | Code::NotFound
        | Code::FailedPrecondition
        | Code::ResourceExhausted => s.clone(),
        _ => unavailable(service, s.message()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statuses_carry_their_details() {
        let s = unavailable("tracking", "connection refused");
        assert_eq!(s.code(), Code::Unavailable);
        let delay = s
            .get_error_details()
            .retry_info()
            .and_then(|r| r.retry_delay);
        assert_eq!(delay, Some(RETRY_UPSTREAM));
        let inner = Status::internal("boom");
        assert_eq!(from_upstream("cloth", &inner).code(), Code::Unavailable);
        assert_eq!(
            from_upstream("cloth", &Status::not_found("x")).code(),
            Code::NotFound
        );
    }
}
