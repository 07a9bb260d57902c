//! HTTP/1.1 and HTTP/2 on accepted connections. Of what a reader does not take, one message and [`SEND_BUFFER`] wait in
//! this process; the rest waits in the reader's own windows.

mod frames;
mod ledger;
mod meter;

use crate::connections::{Connection, Seat};
use crate::queue::consumption::Consumption;
use crate::tls::Tls;
use axum::Router;
use axum::body::Body;
use futures::{Stream, StreamExt};
use http::{Request, Version};
use hyper::body::Incoming;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use hyper_util::server::graceful::{GracefulShutdown, Watcher};
use meter::Metered;
use std::future::Future;
use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio_rustls::TlsAcceptor;
use tonic::transport::server::{Connected, TcpConnectInfo};
use tower::ServiceExt;

/// Interval of pings, which detect clients that vanished.
const PING_EVERY: Duration = Duration::from_secs(5);
/// Time without an answer to a ping after which the client counts as gone.
const PING_TIMEOUT: Duration = Duration::from_secs(5);
/// Most streams on one connection: a kiosk opens three, a page six.
const MAX_STREAMS: u32 = 64;
/// Largest headers, bytes: those of our clients take 1 kB.
const MAX_HEADER_BYTES: usize = 16 * 1024;
/// Time of the headers of an HTTP/1.1 request.
const HEADERS: Duration = Duration::from_secs(10);
/// Time of a TLS handshake.
const HANDSHAKE: Duration = Duration::from_secs(10);
/// Bytes of a stream that may wait here beside the message that is being written. Less costs more wakeups.
const SEND_BUFFER: usize = 16 * 1024;
/// Bytes that a caller may send ahead of a stream's handler, and of all handlers of a connection.
const RECEIVE_WINDOWS: (u32, u32) = (64 * 1024, 256 * 1024);

/// Protocols of a port.
pub(crate) struct Protocols {
    /// HTTP/1.1 beside HTTP/2, for browsers.
    pub(crate) has_http1: bool,
    pub(crate) tls: Tls,
}

/// Encryption of the connection of a request, in its extensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct IsEncrypted(pub(crate) bool);

/// Serves `router` until `stop`, then until the last request is answered.
pub(crate) async fn serve(
    incoming: impl Stream<Item = io::Result<Connection>>,
    router: Router,
    protocols: &Protocols,
    stop: impl Future<Output = ()>,
) {
    let encryption = || {
        protocols
            .tls
            .acceptor()
            .map_or(Encryption::Off, Encryption::Needed)
    };
    serve_by(incoming, router, protocols.has_http1, encryption, stop).await;
}

/// Serves `router` as [`serve`] does, to HTTP/1.1 and HTTP/2, with and without TLS: a connection's first byte tells.
pub(crate) async fn serve_mixed(
    incoming: impl Stream<Item = io::Result<Connection>>,
    router: Router,
    tls: &Tls,
    stop: impl Future<Output = ()>,
) {
    let encryption = || tls.acceptor().map_or(Encryption::Off, Encryption::Offered);
    serve_by(incoming, router, true, encryption, stop).await;
}

/// Encryption of a new connection.
enum Encryption {
    /// Plain.
    Off,
    /// TLS, or plain if the client begins so.
    Offered(TlsAcceptor),
    /// TLS only.
    Needed(TlsAcceptor),
}

async fn serve_by(
    incoming: impl Stream<Item = io::Result<Connection>>,
    router: Router,
    has_http1: bool,
    encryption: impl Fn() -> Encryption,
    stop: impl Future<Output = ()>,
) {
    let graceful = GracefulShutdown::new();
    let builder = builder(has_http1);
    let mut incoming = Box::pin(incoming);
    let mut stop = pin!(stop);
    loop {
        let accepted = tokio::select! {
            biased;
            () = &mut stop => break,
            accepted = incoming.next() => accepted,
        };
        match accepted {
            Some(Ok(connection)) => {
                let serving = Serving {
                    peer: connection.connect_info(),
                    seat: connection.seat(),
                    router: router.clone(),
                    builder: builder.clone(),
                    watcher: graceful.watcher(),
                };
                tokio::spawn(serving.accept(connection, encryption()));
            }
            Some(Err(_)) => (),
            None => break,
        }
    }
    // Closes the listener: new connections are refused while the open ones finish.
    drop(incoming);
    graceful.shutdown().await;
}

fn builder(has_http1: bool) -> Builder<TokioExecutor> {
    let mut builder = Builder::new(TokioExecutor::new());
    builder
        .http1()
        .timer(TokioTimer::new())
        .header_read_timeout(HEADERS)
        .max_buf_size(MAX_HEADER_BYTES);
    let (stream, connection) = RECEIVE_WINDOWS;
    builder
        .http2()
        .timer(TokioTimer::new())
        .keep_alive_interval(PING_EVERY)
        .keep_alive_timeout(PING_TIMEOUT)
        .max_header_list_size(MAX_HEADER_BYTES as u32)
        .max_concurrent_streams(MAX_STREAMS)
        .initial_stream_window_size(stream)
        .initial_connection_window_size(connection)
        .max_send_buf_size(SEND_BUFFER);
    if has_http1 {
        builder
    } else {
        builder.http2_only()
    }
}

/// Service of one connection.
struct Serving {
    peer: TcpConnectInfo,
    seat: Arc<Seat>,
    router: Router,
    builder: Builder<TokioExecutor>,
    watcher: Watcher,
}

impl Serving {
    /// Encrypts the connection as its port demands, and answers its requests to its end.
    async fn accept(self, mut connection: Connection, encryption: Encryption) {
        let tls = match encryption {
            Encryption::Off => return self.answer(connection, IsEncrypted(false)).await,
            Encryption::Needed(tls) => tls,
            Encryption::Offered(tls) => match connection.begins_tls().await {
                Ok(true) => tls,
                Ok(false) => return self.answer(connection, IsEncrypted(false)).await,
                Err(_) => return,
            },
        };
        match tokio::time::timeout(HANDSHAKE, tls.accept(connection)).await {
            Ok(Ok(encrypted)) => self.answer(encrypted, IsEncrypted(true)).await,
            Ok(Err(e)) => tracing::debug!(error = %e, "a connection could not be encrypted"),
            Err(_) => tracing::debug!("a connection was not encrypted in time"),
        }
    }

    async fn answer(
        self,
        io: impl AsyncRead + AsyncWrite + Send + Unpin + 'static,
        is_encrypted: IsEncrypted,
    ) {
        let Self {
            peer,
            seat,
            router,
            builder,
            watcher,
        } = self;
        let consumption = Consumption::default();
        let metered = Metered::new(io, seat.clone(), consumption.clone());
        let service = hyper::service::service_fn(move |mut request: Request<Incoming>| {
            let is_reported = request.version() == Version::HTTP_2;
            let extensions = request.extensions_mut();
            extensions.insert(peer.clone());
            extensions.insert(seat.clone());
            extensions.insert(is_encrypted);
            if is_reported {
                extensions.insert(consumption.clone());
            }
            router.clone().oneshot(request.map(Body::new))
        });
        let work = builder.serve_connection(TokioIo::new(metered), service);
        if let Err(e) = watcher.watch(work.into_owned()).await {
            tracing::debug!(error = %e, "a connection broke");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connections::{self, Limits};
    use axum::routing::any;
    use std::net::SocketAddr;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::net::{TcpListener, TcpStream};

    const HELLO: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0";
    const PING: &[u8] = b"\0\0\x08\x06\0\0\0\0\0pingpong";
    const SETTINGS: &[u8] = b"\0\0\0\x04\0\0\0\0\0";
    const MANY: usize = 5000;

    /// A port that answers every request with 100 bytes.
    async fn port() -> SocketAddr {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let address = listener.local_addr().expect("bound");
        tokio::spawn(async move {
            let router = Router::new().fallback(any(|| async { "x".repeat(100) }));
            let protocols = Protocols {
                has_http1: true,
                tls: Tls::off(),
            };
            let incoming = connections::accept(listener, Limits::default());
            serve(incoming, router, &protocols, std::future::pending()).await;
        });
        address
    }

    /// Bytes that are answered to `frames` until nothing comes for a second; whether the connection was closed.
    async fn answered(address: SocketAddr, frames: Vec<u8>) -> (usize, bool) {
        let stream = TcpStream::connect(address).await.expect("connects");
        let (mut from, mut to) = stream.into_split();
        tokio::spawn(async move {
            let _ = to.write_all(&frames).await;
            std::future::pending::<()>().await;
        });
        let (mut bytes, mut buffer) = (0, vec![0; 65536]);
        loop {
            let read = from.read(&mut buffer);
            match tokio::time::timeout(Duration::from_secs(1), read).await {
                Err(_) => return (bytes, false),
                Ok(Ok(0) | Err(_)) => return (bytes, true),
                Ok(Ok(n)) => bytes += n,
            }
        }
    }

    #[tokio::test]
    async fn floods_of_control_frames_and_of_single_bytes_are_cut() {
        let address = port().await;
        for flood in [PING, SETTINGS] {
            let frames = [HELLO, &flood.repeat(MANY)].concat();
            let (bytes, is_closed) = answered(address, frames).await;
            assert!(is_closed && bytes < MANY * flood.len() / 2, "{bytes}");
            let few = [HELLO, &flood.repeat(100)].concat();
            let (bytes, is_closed) = answered(address, few).await;
            assert!(!is_closed && bytes >= 100 * flood.len(), "{bytes}");
        }
        let mut dribble = TcpStream::connect(address).await.expect("connects");
        dribble.set_nodelay(true).expect("a socket");
        let mut sent = 0;
        while sent < MANY && dribble.write_all(b"x").await.is_ok() {
            tokio::time::sleep(Duration::from_millis(1)).await;
            sent += 1;
        }
        assert!(sent < MANY, "{sent}");
    }

    #[tokio::test]
    async fn a_busy_client_is_not_cut() {
        let address = port().await;
        let mut http1 = TcpStream::connect(address).await.expect("connects");
        let mut buffer = vec![0; 4096];
        for _ in 0..1000 {
            let request = http1.write_all(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n");
            request.await.expect("sent");
            assert!(http1.read(&mut buffer).await.expect("answered") > 100);
        }
        let channel = tonic::transport::Endpoint::from_shared(format!("http://{address}"));
        let channel = channel.expect("a URL").connect().await.expect("connects");
        for _ in 0..50 {
            let calls = (0..50).map(|_| {
                let request = Request::post("/x").body(tonic::body::Body::empty());
                channel.clone().oneshot(request.expect("a request"))
            });
            for answer in futures::future::join_all(calls).await {
                let body = Body::new(answer.expect("answered").into_body());
                let body = axum::body::to_bytes(body, 1000).await.expect("a body");
                assert_eq!(body.len(), 100);
            }
        }
    }
}
