//! Budget of what a connection costs beside its calls: reads and frames of HTTP/2 (RFC 9113), against calls that it makes
//! and bytes that it takes. A flood of PING or SETTINGS, or of single bytes, ends with the connection.

use crate::connections::Seat;
use crate::peer_budget::Allowance;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Instant;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

/// Reads and frames for which nothing was paid. One costs 5 to 10 µs, so that 512 connections at this rate take a tenth
/// of a core. A client without calls pings each 10 s.
const ALLOWANCE: Allowance = Allowance {
    burst: 200.0,
    per_second: 20.0,
};
/// Credit of a call: its frames, and the window updates of its answer.
const PER_CALL: f64 = 6.0;
/// Bytes sent that pay for a read or frame: a reader acknowledges its pictures' bytes, at worst frame by frame. The
/// answer to a PING has 17.
const BYTES_SENT: f64 = 256.0;
/// Bytes of a call's message that pay for a read or frame: uploads come in reads of a packet or more.
const BYTES_RECEIVED: f64 = 512.0;
/// Begin of every connection of HTTP/2.
const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
const FRAME_HEAD: usize = 9;
/// Types of the frames of a message and of the begin of a call.
const DATA: u8 = 0;
const HEADERS: u8 = 1;

/// Position in the bytes that a client sends.
enum Position {
    /// Bytes of the preface that were read.
    Preface(usize),
    /// Head of a frame, and its bytes that were read.
    Head([u8; FRAME_HEAD], usize),
    /// Bytes of a payload that are still to come, and whether it is a part of a message.
    Payload(usize, bool),
    /// Not HTTP/2.
    Other,
}

/// Frames of a client, counted as their heads arrive.
struct Frames(Position);

/// Contents of some bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counted {
    frames: u32,
    /// Frames that begin a call.
    calls: u32,
    /// Bytes of messages.
    data: usize,
}

impl Frames {
    /// Frames whose heads end in `bytes`.
    fn count(&mut self, mut bytes: &[u8]) -> Counted {
        let mut counted = Counted::default();
        while !bytes.is_empty() {
            let used = match &mut self.0 {
                Position::Preface(at) => {
                    let n = bytes.len().min(PREFACE.len() - *at);
                    *at += n;
                    if bytes[..n] != PREFACE[*at - n..*at] {
                        self.0 = Position::Other;
                    } else if *at == PREFACE.len() {
                        self.0 = Position::Head([0; FRAME_HEAD], 0);
                    }
                    n
                }
                Position::Head(head, at) => {
                    let n = bytes.len().min(FRAME_HEAD - *at);
                    head[*at..*at + n].copy_from_slice(&bytes[..n]);
                    *at += n;
                    if *at == FRAME_HEAD {
                        counted.frames += 1;
                        counted.calls += u32::from(head[3] == HEADERS);
                        let length = u32::from_be_bytes([0, head[0], head[1], head[2]]);
                        self.0 = Position::Payload(length as usize, head[3] == DATA);
                    }
                    n
                }
                Position::Payload(left, is_data) => {
                    let n = bytes.len().min(*left);
                    *left -= n;
                    counted.data += if *is_data { n } else { 0 };
                    if *left == 0 {
                        self.0 = Position::Head([0; FRAME_HEAD], 0);
                    }
                    n
                }
                Position::Other => bytes.len(),
            };
            bytes = &bytes[used..];
        }
        counted
    }
}

/// Credit of a connection.
struct Credit {
    left: f64,
    at: Instant,
}

impl Credit {
    /// Adds what the time and `earned` give; no more than the burst is kept.
    fn earn(&mut self, earned: f64, now: Instant) {
        let gained = now.saturating_duration_since(self.at).as_secs_f64() * ALLOWANCE.per_second;
        *self = Self {
            left: (self.left + gained + earned).min(ALLOWANCE.burst),
            at: now,
        };
    }
}

/// A connection within its budget; above encryption, where frames are seen.
pub(super) struct Metered<Io> {
    io: Io,
    seat: Arc<Seat>,
    frames: Frames,
    credit: Credit,
    has_spoken: bool,
}

impl<Io> Metered<Io> {
    pub(super) fn new(io: Io, seat: Arc<Seat>) -> Self {
        Self {
            io,
            seat,
            frames: Frames(Position::Preface(0)),
            credit: Credit {
                left: ALLOWANCE.burst,
                at: Instant::now(),
            },
            has_spoken: false,
        }
    }

    /// Pays for a read.
    ///
    /// # Errors
    /// When the budget is spent.
    fn pay(&mut self, bytes: &[u8]) -> io::Result<()> {
        if !self.has_spoken {
            self.has_spoken = true;
            self.seat.speak();
        }
        let Counted {
            frames,
            calls,
            data,
        } = self.frames.count(bytes);
        let earned = f64::from(calls) * PER_CALL + data as f64 / BYTES_RECEIVED;
        self.credit.earn(earned, Instant::now());
        self.credit.left -= 1.0 + f64::from(frames);
        if self.credit.left >= 0.0 {
            return Ok(());
        }
        metrics::counter!("tryon_connections_flooding").increment(1);
        Err(io::ErrorKind::ConnectionAborted.into())
    }

    fn on_written(&mut self, result: &io::Result<usize>) {
        if let Ok(n) = result {
            self.credit.earn(*n as f64 / BYTES_SENT, Instant::now());
        }
    }
}

impl<Io: AsyncRead + Unpin> AsyncRead for Metered<Io> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buf.filled().len();
        ready!(Pin::new(&mut self.io).poll_read(cx, buf))?;
        match &buf.filled()[before..] {
            [] => Poll::Ready(Ok(())),
            read => Poll::Ready(self.pay(read)),
        }
    }
}

impl<Io: AsyncWrite + Unpin> AsyncWrite for Metered<Io> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &[u8],
    ) -> Poll<io::Result<usize>> {
        let result = ready!(Pin::new(&mut self.io).poll_write(cx, buf));
        self.on_written(&result);
        Poll::Ready(result)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bufs: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let result = ready!(Pin::new(&mut self.io).poll_write_vectored(cx, bufs));
        self.on_written(&result);
        Poll::Ready(result)
    }

    fn is_write_vectored(&self) -> bool {
        self.io.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_shutdown(cx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(kind: u8, length: usize) -> Vec<u8> {
        let mut f = (length as u32).to_be_bytes()[1..].to_vec();
        f.extend([kind, 0, 0, 0, 0, 0]);
        f.resize(FRAME_HEAD + length, 0);
        f
    }

    #[test]
    fn frames_are_counted_wherever_reads_are_cut() {
        let stream = [
            PREFACE,
            &frame(4, 18),
            &frame(HEADERS, 300),
            &frame(6, 8),
            &frame(DATA, 900),
            &frame(DATA, 0),
        ];
        let stream = stream.concat();
        for cut in 1..stream.len() {
            let mut frames = Frames(Position::Preface(0));
            let counts = stream.chunks(cut).map(|c| frames.count(c));
            let sum = counts.fold((0, 0, 0), |a, b| {
                (a.0 + b.frames, a.1 + b.calls, a.2 + b.data)
            });
            assert_eq!(sum, (5, 1, 900), "{cut}");
        }
        let mut http1 = Frames(Position::Preface(0));
        assert_eq!(http1.count(b"PRI * HTTP/1.1\r\n"), Counted::default());
        assert_eq!(http1.count(&frame(HEADERS, 0)), Counted::default());
    }
}
