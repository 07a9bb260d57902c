//! HTTP/1.1 and HTTP/2 on accepted connections. Of what a reader does not take, one message and [`SEND_BUFFER`] wait in
//! this process; the rest waits in the reader's own windows.

use crate::connections::Connection;
use crate::tls::Tls;
use axum::Router;
use axum::body::Body;
use futures::{Stream, StreamExt};
use http::Request;
use hyper::body::Incoming;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use hyper_util::server::graceful::{GracefulShutdown, Watcher};
use std::future::Future;
use std::io;
use std::pin::pin;
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

/// Serves `router` until `stop`, then until the last request is answered.
pub(crate) async fn serve(
    incoming: impl Stream<Item = io::Result<Connection>>,
    router: Router,
    protocols: &Protocols,
    stop: impl Future<Output = ()>,
) {
    let graceful = GracefulShutdown::new();
    let builder = builder(protocols.has_http1);
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
                    router: router.clone(),
                    builder: builder.clone(),
                    watcher: graceful.watcher(),
                };
                tokio::spawn(serving.accept(connection, protocols.tls.acceptor()));
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
    router: Router,
    builder: Builder<TokioExecutor>,
    watcher: Watcher,
}

impl Serving {
    /// Encrypts the connection where there is a certificate, and answers its requests to its end.
    async fn accept(self, connection: Connection, tls: Option<TlsAcceptor>) {
        let Some(tls) = tls else {
            return self.answer(connection).await;
        };
        match tokio::time::timeout(HANDSHAKE, tls.accept(connection)).await {
            Ok(Ok(encrypted)) => self.answer(encrypted).await,
            Ok(Err(e)) => tracing::debug!(error = %e, "a connection could not be encrypted"),
            Err(_) => tracing::debug!("a connection was not encrypted in time"),
        }
    }

    async fn answer(self, io: impl AsyncRead + AsyncWrite + Send + Unpin + 'static) {
        let Self {
            peer,
            router,
            builder,
            watcher,
        } = self;
        let service = hyper::service::service_fn(move |mut request: Request<Incoming>| {
            request.extensions_mut().insert(peer.clone());
            router.clone().oneshot(request.map(Body::new))
        });
        let work = builder.serve_connection(TokioIo::new(io), service);
        if let Err(e) = watcher.watch(work.into_owned()).await {
            tracing::debug!(error = %e, "a connection broke");
        }
    }
}
