//! Accepted connections: no delay, a limit on their number, an end for those on which nothing moves.

use futures::Stream;
use futures::task::AtomicWaker;
use std::collections::BTreeMap;
use std::future::Future;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{Instant, Sleep};
use tonic::transport::server::{Connected, TcpConnectInfo};

/// Bytes that may wait unsent in a socket; Linux keeps up to 4 MB otherwise. Less costs more wakeups.
#[cfg(target_os = "linux")]
const UNSENT_BYTES: u32 = 16 * 1024;

/// Limits of one port.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Most connections: a soft limit of 1024 descriptors leaves as many again for everything else. When all are taken,
    /// the oldest that never sent a byte makes place; if there is none, the new one is closed.
    pub(crate) connections: usize,
    /// Most connections of one address; further ones are closed. The machine's own clients share its loopback address and
    /// have no such limit.
    pub(crate) per_peer: usize,
    /// Time without a byte in either direction after which a connection is closed. HTTP/2 is pinged twice in it, and
    /// every stream of HTTP/1.1 sends twice a second, so only stuck peers and unused connections reach it.
    pub(crate) idle: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            connections: 512,
            per_peer: 64,
            idle: Duration::from_secs(10),
        }
    }
}

/// Seat of one connection.
#[derive(Default)]
struct Seat {
    is_evicted: AtomicBool,
    waker: AtomicWaker,
}

/// Taken seats in order of arrival; those that never sent a byte apart.
#[derive(Default)]
struct Seats {
    next: u64,
    silent: BTreeMap<u64, Arc<Seat>>,
    taken: usize,
    /// Taken seats by address, of other machines.
    peers: BTreeMap<IpAddr, usize>,
}

type Directory = Arc<Mutex<Seats>>;

fn with<R>(seats: &Directory, f: impl FnOnce(&mut Seats) -> R) -> R {
    f(&mut seats.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Address whose connections are counted; `None` for this machine's own.
fn counted(peer: SocketAddr) -> Option<IpAddr> {
    Some(peer.ip().to_canonical()).filter(|ip| !ip.is_loopback())
}

/// Takes a seat; `None` when its address has too many, or all are taken by connections that have spoken.
fn take_seat(seats: &Directory, limits: &Limits, peer: Option<IpAddr>) -> Option<(u64, Arc<Seat>)> {
    with(seats, |s| {
        let of_peer = peer.map_or(0, |ip| s.peers.get(&ip).copied().unwrap_or(0));
        if of_peer >= limits.per_peer {
            return None;
        }
        if s.taken >= limits.connections {
            let (_, oldest) = s.silent.pop_first()?;
            oldest.is_evicted.store(true, Ordering::Release);
            oldest.waker.wake();
            metrics::counter!("tryon_connections_evicted").increment(1);
        }
        let (number, seat) = (s.next, Arc::<Seat>::default());
        s.next += 1;
        s.taken += 1;
        if let Some(ip) = peer {
            *s.peers.entry(ip).or_default() += 1;
        }
        s.silent.insert(number, seat.clone());
        Some((number, seat))
    })
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
            let peer = counted(peer);
            let Some((number, seat)) = take_seat(&seats, &limits, peer) else {
                metrics::counter!("tryon_connections_refused").increment(1);
                continue;
            };
            let now = Instant::now();
            let connection = Connection {
                stream,
                idle: limits.idle,
                moved: now,
                timer: Box::pin(tokio::time::sleep_until(now + limits.idle)),
                number,
                has_spoken: false,
                peer,
                seat,
                seats: seats.clone(),
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
    number: u64,
    has_spoken: bool,
    /// Address under which it is counted.
    peer: Option<IpAddr>,
    seat: Arc<Seat>,
    seats: Directory,
}

impl Connection {
    /// Error of a connection that waits for too long or is evicted; else the task is woken when it will be.
    fn poll_end(&mut self, cx: &mut Context<'_>) -> Poll<io::Error> {
        self.seat.waker.register(cx.waker());
        if self.seat.is_evicted.load(Ordering::Acquire) {
            return Poll::Ready(io::ErrorKind::ConnectionAborted.into());
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

    fn on_read(&mut self) {
        self.moved = Instant::now();
        if !self.has_spoken {
            self.has_spoken = true;
            with(&self.seats, |s| s.silent.remove(&self.number));
        }
    }

    /// Passes on a result of the socket; while it waits, looks for the end of the connection.
    fn or_end<T>(
        &mut self,
        cx: &mut Context<'_>,
        result: Poll<io::Result<T>>,
    ) -> Poll<io::Result<T>> {
        match result {
            Poll::Ready(r) => Poll::Ready(r),
            Poll::Pending => self.poll_end(cx).map(Err),
        }
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        with(&self.seats, |s| {
            s.silent.remove(&self.number);
            s.taken -= 1;
            if let Some(ip) = self.peer
                && let Some(count) = s.peers.get_mut(&ip)
            {
                *count -= 1;
                if *count == 0 {
                    s.peers.remove(&ip);
                }
            }
        });
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
            self.on_read();
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
    async fn the_oldest_silent_connection_makes_place_and_speakers_do_not() {
        let limits = Limits {
            connections: 2,
            ..Limits::default()
        };
        let (address, mut accepted) = port(limits).await;
        let mut speaker = TcpStream::connect(address).await.expect("connects");
        let mut spoken = accepted.next().await.expect("open").expect("accepted");
        speaker.write_all(b"x").await.expect("sent");
        spoken.read_u8().await.expect("spoken");
        let _silent = TcpStream::connect(address).await.expect("connects");
        let mut silent = accepted.next().await.expect("open").expect("accepted");
        let mut third = TcpStream::connect(address).await.expect("connects");
        let mut heard = accepted.next().await.expect("open").expect("accepted");
        let end = silent.read_u8().await.expect_err("evicted");
        assert_eq!(end.kind(), io::ErrorKind::ConnectionAborted);

        drop(silent);
        third.write_all(b"x").await.expect("sent");
        heard.read_u8().await.expect("spoken");
        let mut fourth = TcpStream::connect(address).await.expect("connects");
        let refused = tokio::time::timeout(Duration::from_millis(100), accepted.next()).await;
        assert!(refused.is_err(), "two speakers have both seats");
        assert_eq!(fourth.read(&mut [0]).await.unwrap_or(0), 0, "closed");
    }

    #[test]
    fn another_machine_has_its_share_of_the_seats_and_this_one_all() {
        let limits = Limits {
            per_peer: 2,
            ..Limits::default()
        };
        let seats = Directory::default();
        let far: SocketAddr = "192.0.2.1:9".parse().expect("an address");
        let near: SocketAddr = "[::ffff:127.0.0.1]:9".parse().expect("an address");
        let take = |peer| take_seat(&seats, &limits, counted(peer)).is_some();
        assert_eq!([far, far, far].map(take), [true, true, false]);
        assert_eq!([near, near, near].map(take), [true; 3]);
        assert_eq!(with(&seats, |s| (s.taken, s.peers.len())), (5, 1));
    }
}
