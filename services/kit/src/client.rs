//! Clients that come back: lazy connections that notice a dead peer, and pauses between attempts.

use backon::{BackoffBuilder, ExponentialBuilder};
use std::time::Duration;
use tonic::transport::{Channel, Endpoint};

/// A ping on an open stream goes out this often; no answer within [`PING_TIMEOUT`] means that the peer is gone. A killed
/// process closes its connection at once, and streams repeat themselves twice a second, so a stopped one is noticed
/// by its silence within a second: pings only clear away connections to machines that vanished. Shorter ones cut off
/// living neighbours on a busy two-core box.
const PING_EVERY: Duration = Duration::from_secs(1);
const PING_TIMEOUT: Duration = Duration::from_secs(2);
const CONNECT_TIMEOUT: Duration = Duration::from_millis(500);

/// Deadline of a unary call to a neighbour on the same box.
pub const CALL_DEADLINE: Duration = Duration::from_secs(2);

/// A connection that is made when first used and made again after each loss. Open one for each frame stream: a slow
/// reader stalls the other streams of its connection (hyper #2899).
///
/// # Errors
/// When `url` is none.
pub fn channel(url: &str) -> Result<Channel, String> {
    let endpoint = Endpoint::from_shared(url.to_owned()).map_err(|e| format!("{url}: {e}"))?;
    Ok(endpoint
        .connect_timeout(CONNECT_TIMEOUT)
        .tcp_nodelay(true)
        .http2_keep_alive_interval(PING_EVERY)
        .keep_alive_timeout(PING_TIMEOUT)
        .keep_alive_while_idle(false)
        .connect_lazy())
}

/// A request with the deadline of a unary call.
pub fn request<T>(message: T) -> tonic::Request<T> {
    let mut r = tonic::Request::new(message);
    r.set_timeout(CALL_DEADLINE);
    r
}

/// Pauses between attempts: 50 ms, doubling to half a second, forever, jittered so that neighbours do not march.
pub fn pauses() -> impl Iterator<Item = Duration> + Send {
    ExponentialBuilder::new()
        .with_min_delay(Duration::from_millis(50))
        .with_max_delay(Duration::from_millis(500))
        .with_jitter()
        .without_max_times()
        .build()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_stay_short_and_never_end() {
        let all: Vec<Duration> = pauses().take(100).collect();
        assert_eq!(all.len(), 100);
        assert!(
            all.iter().all(|d| *d <= Duration::from_millis(1000)),
            "{all:?}"
        );
    }

    #[tokio::test]
    async fn a_url_that_is_none_is_refused() {
        assert!(channel("not a url").is_err());
        assert!(channel("http://127.0.0.1:1").is_ok());
    }
}
