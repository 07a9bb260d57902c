//! Accepted connections: no delay, a limit on their number, an end for those on which nothing moves.

mod descriptors;
mod seats;

pub(crate) use seats::Seat;

use futures::Stream;
use seats::{Directory, counted};
use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{Instant, Sleep};
use tonic::transport::server::{Connected, TcpConnectInfo};

/// Bytes that may wait unsent in a socket; Linux keeps up to 4 MB otherwise. Less costs more wakeups.
#[cfg(target_os = "linux")]
const UNSENT_BYTES: u32 = 16 * 1024;
/// First byte of a TLS connection: the type of a record with a handshake (RFC 8446, 5.1).
const TLS_HANDSHAKE: u8 = 22;

/// Limits of one port.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Most connections. When all are taken, one that has proved nothing ends for the next; if there is none, the new
    /// one is closed.
    pub(crate) connections: usize,
    /// Most connections of one address, or of one /64 of IPv6; beyond it one of them ends for the next. The machine's
    /// own clients share its loopback address and have no such limit.
    pub(crate) per_peer: usize,
    /// Time without a byte in either direction after which a connection is closed. HTTP/2 is pinged twice in it, and
    /// every stream of HTTP/1.1 sends twice a second, so only stuck peers and unused connections reach it.
    pub(crate) idle: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            connections: descriptors::seats(),
            per_peer: 64,
            idle: Duration::from_secs(10),
        }
    }
}

impl Limits {
    /// Limits of a port of probes.
    pub(crate) fn of_probes() -> Self {
        Self {
            connections: descriptors::PROBES,
            per_peer: descriptors::PROBES / 2,
            ..Self::default()
        }
    }
}

/// Connections of a listener within limits. Errors of single connections are left out; a listener without descriptors
/// pauses.
pub(crate) fn accept(
    listener: TcpListener,
    limits: Limits,
) -> impl Stream<Item = io::Result<Connection>> {
    let start = (listener, Directory::default());
    futures::stream::unfold(start, move |(listener, seats)| async move {
        loop {
            let (stream, peer) = match listener.accept().await {
                Ok(accepted) => accepted,
                Err(e) => {
                    tracing::warn!(error = %e, "a connection could not be accepted");
                    tokio::time::sleep(Duration::from_millis(50)).await;
                    continue;
                }
            };
            // Small messages wait for nothing, and large ones not in the socket. Neither is a condition for service.
            let _ = stream.set_nodelay(true);
            #[cfg(target_os = "linux")]
            let _ = socket2::SockRef::from(&stream).set_tcp_notsent_lowat(UNSENT_BYTES);
            let Some(seat) = seats.take(&limits, counted(peer)) else {
                metrics::counter!("tryon_connections_refused").increment(1);
                continue;
            };
            let now = Instant::now();
            let connection = Connection {
                stream,
                idle: limits.idle,
                moved: now,
                timer: Box::pin(tokio::time::sleep_until(now + limits.idle)),
                seat,
            };
            return Some((Ok(connection), (listener, seats)));
        }
    })
}

/// A connection that ends when it idles or is evicted.
pub(crate) struct Connection {
    stream: TcpStream,
    idle: Duration,
    /// Last byte in either direction.
    moved: Instant,
    timer: Pin<Box<Sleep>>,
    seat: Arc<Seat>,
}

impl Connection {
    /// Its seat, which its calls mark.
    pub(crate) fn seat(&self) -> Arc<Seat> {
        self.seat.clone()
    }

    /// Its first byte, which stays unread, is that of TLS.
    ///
    /// # Errors
    /// When it ends before.
    pub(crate) async fn begins_tls(&mut self) -> io::Result<bool> {
        let mut first = [0];
        std::future::poll_fn(|cx| {
            let mut buffer = ReadBuf::new(&mut first);
            let peeked = self.stream.poll_peek(cx, &mut buffer);
            self.or_end(cx, peeked)
        })
        .await?;
        Ok(first[0] == TLS_HANDSHAKE)
    }

    /// Error of a connection that waits for too long or is evicted; else the task is woken when it will be.
    fn poll_end(&mut self, cx: &mut Context<'_>) -> Poll<io::Error> {
        if self.seat.poll_end(cx).is_ready() {
            return Poll::Ready(ended());
        }
        loop {
            ready!(self.timer.as_mut().poll(cx));
            // The timer is moved only when it fires: most reads and writes cost no more than the time of day.
            let due = self.moved + self.idle;
            if due <= Instant::now() {
                return Poll::Ready(io::ErrorKind::TimedOut.into());
            }
            self.timer.as_mut().reset(due);
        }
    }

    /// Passes on a result of the socket, unless the connection must end.
    fn or_end<T>(
        &mut self,
        cx: &mut Context<'_>,
        result: Poll<io::Result<T>>,
    ) -> Poll<io::Result<T>> {
        match result {
            // A flood is always ready: it must not outrun its end.
            Poll::Ready(_) if self.seat.is_ended() => Poll::Ready(Err(ended())),
            Poll::Ready(r) => Poll::Ready(r),
            Poll::Pending => self.poll_end(cx).map(Err),
        }
    }
}

/// Error of a connection whose seat was taken back.
fn ended() -> io::Error {
    io::ErrorKind::ConnectionAborted.into()
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.seat.leave();
    }
}

impl Connected for Connection {
    type ConnectInfo = TcpConnectInfo;

    fn connect_info(&self) -> TcpConnectInfo {
        let address = |r: io::Result<SocketAddr>| r.ok();
        TcpConnectInfo {
            local_addr: address(self.stream.local_addr()),
            remote_addr: address(self.stream.peer_addr()),
        }
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buf.filled().len();
        let result = Pin::new(&mut self.stream).poll_read(cx, buf);
        if buf.filled().len() > before {
            self.moved = Instant::now();
        }
        self.or_end(cx, result)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &[u8],
    ) -> Poll<io::Result<usize>> {
        let result = Pin::new(&mut self.stream).poll_write(cx, buf);
        if result.is_ready() {
            self.moved = Instant::now();
        }
        self.or_end(cx, result)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bufs: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let result = Pin::new(&mut self.stream).poll_write_vectored(cx, bufs);
        if result.is_ready() {
            self.moved = Instant::now();
        }
        self.or_end(cx, result)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use futures::StreamExt;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    async fn port(
        limits: Limits,
    ) -> (
        SocketAddr,
        Pin<Box<dyn Stream<Item = io::Result<Connection>>>>,
    ) {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let address = listener.local_addr().expect("bound");
        (address, Box::pin(accept(listener, limits)))
    }

    #[tokio::test]
    async fn small_packets_are_sent_at_once() {
        let (address, mut accepted) = port(Limits::default()).await;
        let _client = TcpStream::connect(address).await.expect("connects");
        let c = accepted.next().await.expect("open").expect("accepted");
        assert!(c.stream.nodelay().expect("a socket"));
    }

    #[tokio::test]
    async fn nothing_in_either_direction_is_the_end() {
        let limits = Limits {
            idle: Duration::from_millis(50),
            ..Limits::default()
        };
        let (address, mut accepted) = port(limits).await;
        let mut client = TcpStream::connect(address).await.expect("connects");
        let mut c = accepted.next().await.expect("open").expect("accepted");
        client.write_all(b"GET / HT").await.expect("sent");
        let mut head = [0; 8];
        c.read_exact(&mut head).await.expect("half a request");
        let end = c.read(&mut head).await.expect_err("nothing follows");
        assert_eq!(end.kind(), io::ErrorKind::TimedOut);
    }

    #[tokio::test]
    async fn a_peer_that_takes_nothing_is_the_end_of_a_write() {
        let limits = Limits {
            idle: Duration::from_millis(50),
            ..Limits::default()
        };
        let (address, mut accepted) = port(limits).await;
        let _client = TcpStream::connect(address).await.expect("connects");
        let mut c = accepted.next().await.expect("open").expect("accepted");
        let end = c
            .write_all(&vec![0; 64 << 20])
            .await
            .expect_err("nobody reads");
        assert_eq!(end.kind(), io::ErrorKind::TimedOut);
    }

    #[tokio::test]
    async fn a_stranger_ends_for_a_newcomer_and_a_proven_connection_does_not() {
        let limits = Limits {
            connections: 2,
            ..Limits::default()
        };
        let (address, mut accepted) = port(limits).await;
        let mut clients = Vec::new();
        let mut next = async || {
            let client = TcpStream::connect(address).await;
            clients.push(client.expect("connects"));
            let next = tokio::time::timeout(Duration::from_millis(100), accepted.next()).await;
            next.ok().map(|c| c.expect("open").expect("accepted"))
        };
        let proven = next().await.expect("a seat");
        proven.seat().prove();
        let mut stranger = next().await.expect("a seat");
        stranger.seat().speak();
        let newcomer = next().await.expect("the stranger's seat");
        newcomer.seat().prove();
        let end = stranger.read_u8().await.expect_err("evicted");
        assert_eq!(end.kind(), io::ErrorKind::ConnectionAborted);

        drop(stranger);
        assert!(next().await.is_none(), "both are proven");
        drop(newcomer);
        assert!(next().await.is_some());
    }

    #[tokio::test]
    async fn the_first_byte_tells_tls_and_stays_unread() {
        let (address, mut accepted) = port(Limits::default()).await;
        for (first, expected) in [(TLS_HANDSHAKE, true), (b'G', false)] {
            let mut client = TcpStream::connect(address).await.expect("connects");
            let mut c = accepted.next().await.expect("open").expect("accepted");
            client.write_u8(first).await.expect("sent");
            assert_eq!(c.begins_tls().await.expect("a byte"), expected);
            assert_eq!(c.read_u8().await.expect("a byte"), first);
        }
    }
}
