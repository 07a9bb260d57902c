//! Reconnecting clients: lazy connections that detect a dead peer, and pauses between attempts.

use crate::tls::Tls;
use backon::{BackoffBuilder, ExponentialBuilder};
use http::Uri;
use http::uri::Scheme;
use hyper_util::rt::TokioIo;
use std::io;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tonic::transport::{Channel, Endpoint};

/// Interval of pings on an open stream. They detect machines that vanished; a stopped process is detected within a
/// second by the silence of its streams. Shorter intervals cut off living neighbours on a busy two-core box.
const PING_EVERY: Duration = Duration::from_secs(1);
/// Time without an answer to a ping after which the peer counts as gone.
const PING_TIMEOUT: Duration = Duration::from_secs(2);
/// Time of one attempt to connect.
const CONNECT_TIMEOUT: Duration = Duration::from_millis(500);

/// Deadline of a unary call to a neighbour on the same box.
pub const CALL_DEADLINE: Duration = Duration::from_secs(2);

/// Connection made on first use and again after each loss. Open one for each frame stream: a slow reader stalls the
/// other streams of its connection (hyper #2899).
///
/// # Errors
/// A malformed URL.
pub fn channel(url: &str, tls: &Tls) -> Result<Channel, String> {
    let endpoint = Endpoint::from_shared(url.to_owned()).map_err(|e| format!("{url}: {e}"))?;
    let tls = tls.clone();
    let connector = tower::service_fn(move |uri: Uri| connect(uri, tls.clone()));
    Ok(endpoint
        .connect_timeout(CONNECT_TIMEOUT)
        .http2_keep_alive_interval(PING_EVERY)
        .keep_alive_timeout(PING_TIMEOUT)
        .keep_alive_while_idle(false)
        .connect_with_connector_lazy(connector))
}

/// Plain or encrypted connection to a service.
async fn connect(uri: Uri, tls: Tls) -> io::Result<TokioIo<Box<dyn Io>>> {
    let is_secure = uri.scheme() == Some(&Scheme::HTTPS);
    let host = (uri.host()).ok_or_else(|| io::Error::other(format!("{uri}: no host")))?;
    let port = uri.port_u16().unwrap_or(if is_secure { 443 } else { 80 });
    let address = (host.trim_start_matches('[').trim_end_matches(']'), port);
    let stream = TcpStream::connect(address).await?;
    stream.set_nodelay(true)?;
    let stream: Box<dyn Io> = if is_secure {
        Box::new(tls.connect(host, stream).await?)
    } else {
        Box::new(stream)
    };
    Ok(TokioIo::new(stream))
}

/// Byte stream of a connection.
trait Io: AsyncRead + AsyncWrite + Send + Unpin {}

impl<T: AsyncRead + AsyncWrite + Send + Unpin> Io for T {}

/// Request with the deadline of a unary call.
pub fn request<T>(message: T) -> tonic::Request<T> {
    let mut r = tonic::Request::new(message);
    r.set_timeout(CALL_DEADLINE);
    r
}

/// Endless pauses between attempts: 50 ms, doubling to half a second, with jitter.
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
        assert!(channel("not a url", &Tls::off()).is_err());
        assert!(channel("http://127.0.0.1:1", &Tls::off()).is_ok());
    }
}
