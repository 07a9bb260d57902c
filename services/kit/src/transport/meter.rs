//! Budget of what a connection costs beside its calls: reads and frames of HTTP/2 (RFC 9113), against calls that it makes
//! and bytes that it takes. A flood of PING or SETTINGS, or of single bytes, ends with the connection. Beside that, the
//! account of what the reader has consumed, for which it is asked by PINGs that the server above does not see.

use super::frames::{ACK, DATA, Frames, HEAD, HEADERS, PING, Part};
use super::ledger::Ledger;
use crate::connections::Seat;
use crate::peer_budget::{Allowance, Bucket};
use crate::queue::consumption::Consumption;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Instant;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tryon_geometry::settings;

/// Reads and frames for which nothing was paid. One costs 5 to 10 µs, so that 512 connections at this rate take a tenth
/// of a core. A client without calls pings each 10 s.
const ALLOWANCE: Allowance = Allowance {
    burst: 200.0,
    per_second: 20.0,
};
/// Payload of the PINGs that this layer adds, which the server's own do not have.
const QUESTION: [u8; 8] = *b"consumed";

settings! {
    /// Credit of a connection, in reads and frames.
    pub struct CreditSettings {
        /// Credit of a call: its frames, and the window updates of its answer.
        pub per_call: f64 = 6.0,
        /// Bytes sent that pay for a read or frame: a reader acknowledges its pictures' bytes, at worst frame by frame. The
        /// answer to a PING has 17.
        pub bytes_sent: f64 = 256.0,
        /// Bytes of a call's message that pay for a read or frame: uploads come in reads of a packet or more.
        pub bytes_received: f64 = 512.0,
        /// Credit of a PING that this layer adds: its answer, and the window updates that come with it.
        pub per_question: f64 = 6.0,
    }
}

/// Contents of some bytes of a client.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counted {
    frames: u32,
    /// Frames that begin a call.
    calls: u32,
    /// Bytes of messages.
    data: usize,
}

impl Counted {
    fn add(&mut self, part: Part) {
        match part {
            Part::Head(head) => {
                self.frames += 1;
                self.calls += u32::from(head.kind == HEADERS);
            }
            Part::Payload(head, n) if head.kind == DATA => self.data += n,
            _ => (),
        }
    }
}

/// A PING between frames, whose answer brings the window updates that a reader would send with the next frame.
struct Question {
    /// Bytes still to be written.
    left: usize,
    is_answered: bool,
}

impl Question {
    const BYTES: usize = HEAD + QUESTION.len();

    fn frame() -> [u8; Self::BYTES] {
        let mut frame = [0; Self::BYTES];
        frame[2] = QUESTION.len() as u8;
        frame[3] = PING;
        frame[HEAD..].copy_from_slice(&QUESTION);
        frame
    }
}

/// A connection within its budget; above encryption, where frames are seen.
pub(super) struct Metered<Io> {
    settings: CreditSettings,
    io: Io,
    seat: Arc<Seat>,
    received: Frames,
    sent: Frames,
    ledger: Ledger,
    consumption: Consumption,
    question: Question,
    credit: Bucket,
    has_spoken: bool,
}

impl<Io> Metered<Io> {
    pub(super) fn new(io: Io, seat: Arc<Seat>, consumption: Consumption) -> Self {
        Self {
            settings: CreditSettings::default(),
            io,
            seat,
            received: Frames::of_client(),
            sent: Frames::of_server(),
            ledger: Ledger::new(consumption.clone()),
            consumption,
            question: Question {
                left: 0,
                is_answered: true,
            },
            credit: Bucket::full(ALLOWANCE, Instant::now()),
            has_spoken: false,
        }
    }

    /// Pays for a read, and takes the answer to a question out of it; the number of bytes left.
    ///
    /// # Errors
    /// When the budget is spent.
    fn on_read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if !self.has_spoken {
            self.has_spoken = true;
            self.seat.speak();
        }
        let (mut counted, mut answer) = (Counted::default(), None);
        self.received.read(bytes, |part, end| {
            counted.add(part);
            self.ledger.on_received(part);
            if is_answer(part) {
                answer = Some(end);
            }
        });
        self.pay(counted)?;
        let Some(end) = answer.filter(|_| !self.question.is_answered) else {
            return Ok(bytes.len());
        };
        self.question.is_answered = true;
        // Of an answer in two reads the server above drops what it knows nothing of.
        let Some(begin) = end.checked_sub(Question::BYTES) else {
            return Ok(bytes.len());
        };
        bytes.copy_within(end.., begin);
        Ok(bytes.len() - Question::BYTES)
    }

    fn pay(&mut self, counted: Counted) -> io::Result<()> {
        let s = &self.settings;
        let earned = f64::from(counted.calls) * s.per_call + counted.data as f64 / s.bytes_received;
        self.credit.earn(earned, Instant::now());
        if self.credit.pay(1.0 + f64::from(counted.frames)) {
            return Ok(());
        }
        metrics::counter!("tryon_connections_flooding").increment(1);
        Err(io::ErrorKind::ConnectionAborted.into())
    }

    fn on_written(&mut self, bytes: &[u8]) {
        let earned = bytes.len() as f64 / self.settings.bytes_sent;
        self.credit.earn(earned, Instant::now());
        self.sent.read(bytes, |part, _| self.ledger.on_sent(part));
    }
}

/// The answer to [`QUESTION`] is complete.
fn is_answer(part: Part) -> bool {
    matches!(part, Part::End(h, QUESTION) if h.kind == PING && h.flags & ACK != 0)
}

impl<Io: AsyncWrite + Unpin> Metered<Io> {
    /// Asks the reader, if somebody wants that and a frame has just ended. Ready once nothing of a question is left to
    /// write; one at a time is on the way.
    fn poll_question(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let is_asked = self.consumption.is_asked(cx);
        if is_asked && self.question.left == 0 && self.sent.is_between() {
            self.consumption.on_asked();
            if self.question.is_answered {
                self.question = Question {
                    left: Question::BYTES,
                    is_answered: false,
                };
                self.credit.earn(self.settings.per_question, Instant::now());
            }
        }
        let mut is_written = false;
        while self.question.left > 0 {
            let rest = &Question::frame()[Question::BYTES - self.question.left..];
            let n = ready!(Pin::new(&mut self.io).poll_write(cx, rest))?;
            if n == 0 {
                return Poll::Ready(Err(io::ErrorKind::WriteZero.into()));
            }
            self.question.left -= n;
            is_written = true;
        }
        if is_written && let Poll::Ready(Err(e)) = Pin::new(&mut self.io).poll_flush(cx) {
            return Poll::Ready(Err(e));
        }
        Poll::Ready(Ok(()))
    }
}

impl<Io: AsyncRead + AsyncWrite + Unpin> AsyncRead for Metered<Io> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buf.filled().len();
        loop {
            if let Poll::Ready(Err(e)) = self.poll_question(cx) {
                return Poll::Ready(Err(e));
            }
            ready!(Pin::new(&mut self.io).poll_read(cx, buf))?;
            if buf.filled().len() == before {
                return Poll::Ready(Ok(()));
            }
            let kept = self.on_read(&mut buf.filled_mut()[before..])?;
            buf.set_filled(before + kept);
            // A read of no bytes would be the end.
            if kept > 0 {
                return Poll::Ready(Ok(()));
            }
        }
    }
}

impl<Io: AsyncWrite + Unpin> AsyncWrite for Metered<Io> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &[u8],
    ) -> Poll<io::Result<usize>> {
        ready!(self.poll_question(cx))?;
        let n = ready!(Pin::new(&mut self.io).poll_write(cx, buf))?;
        self.on_written(&buf[..n]);
        Poll::Ready(Ok(n))
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bufs: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        ready!(self.poll_question(cx))?;
        let n = ready!(Pin::new(&mut self.io).poll_write_vectored(cx, bufs))?;
        let mut left = n;
        for buf in bufs {
            let part = left.min(buf.len());
            self.on_written(&buf[..part]);
            left -= part;
        }
        Poll::Ready(Ok(n))
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
    use super::super::frames::{END_STREAM, PREFACE, SETTINGS, WINDOW_UPDATE, frame};
    use super::*;
    use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};

    #[test]
    fn frames_calls_and_bytes_of_messages_are_counted() {
        let stream = [
            PREFACE,
            &frame(SETTINGS, 0, 0, 18),
            &frame(HEADERS, 0, 1, 300),
            &frame(PING, 0, 0, 8),
            &frame(DATA, 0, 1, 900),
            &frame(DATA, END_STREAM, 1, 0),
        ];
        let (mut counted, mut frames) = (Counted::default(), Frames::of_client());
        frames.read(&stream.concat(), |part, _| counted.add(part));
        let wanted = Counted {
            frames: 5,
            calls: 1,
            data: 900,
        };
        assert_eq!(counted, wanted);
    }

    /// A server's end whose client has begun, and that has sent its first frame; the client's end.
    async fn begun(consumption: &Consumption) -> (Metered<DuplexStream>, DuplexStream) {
        let (near, mut far) = duplex(1 << 16);
        let mut metered = Metered::new(near, Seat::alone(), consumption.clone());
        far.write_all(PREFACE).await.expect("written");
        let mut preface = [0; PREFACE.len()];
        metered.read_exact(&mut preface).await.expect("read");
        let settings = frame(SETTINGS, 0, 0, 0);
        metered.write_all(&settings).await.expect("written");
        let mut head = [0; HEAD];
        far.read_exact(&mut head).await.expect("read");
        (metered, far)
    }

    #[tokio::test]
    async fn a_question_goes_between_frames_and_its_answer_stays_here() {
        let consumption = Consumption::default();
        let (mut metered, mut far) = begun(&consumption).await;
        let data = frame(DATA, 0, 1, 100);
        metered.write_all(&data[..50]).await.expect("written");
        consumption.ask();
        metered.write_all(&data[50..]).await.expect("written");
        let settings = frame(SETTINGS, ACK, 0, 0);
        metered.write_all(&settings).await.expect("written");
        let mut seen = vec![0; data.len() + Question::BYTES + settings.len()];
        far.read_exact(&mut seen).await.expect("read");
        assert_eq!(seen, [&data[..], &Question::frame(), &settings].concat());

        let mut answer = Question::frame();
        answer[4] = ACK;
        let update = frame(WINDOW_UPDATE, 0, 0, 4);
        let all = [&update[..], &answer, &settings];
        far.write_all(&all.concat()).await.expect("written");
        let mut seen = vec![0; 100];
        let n = metered.read(&mut seen).await.expect("read");
        assert_eq!(seen[..n], [update, settings].concat());
    }

    #[tokio::test]
    async fn a_read_of_an_answer_alone_is_no_end() {
        let consumption = Consumption::default();
        let (mut metered, mut far) = begun(&consumption).await;
        let mut answer = Question::frame();
        answer[4] = ACK;
        let ping = frame(PING, 0, 0, 8);
        let client = async {
            let mut seen = [0; Question::BYTES];
            far.read_exact(&mut seen).await.expect("read");
            far.write_all(&answer).await.expect("written");
            tokio::task::yield_now().await;
            far.write_all(&ping).await.expect("written");
            far
        };
        consumption.ask();
        let mut seen = vec![0; 100];
        let (n, _far) = tokio::join!(metered.read(&mut seen), client);
        assert_eq!(seen[..n.expect("read")], ping);
    }

    #[tokio::test]
    async fn http1_is_asked_nothing() {
        let consumption = Consumption::default();
        let (near, mut far) = duplex(1 << 16);
        let mut metered = Metered::new(near, Seat::alone(), consumption.clone());
        consumption.ask();
        metered
            .write_all(b"HTTP/1.1 200 OK\r\n")
            .await
            .expect("written");
        drop(metered);
        let mut seen = String::new();
        far.read_to_string(&mut seen).await.expect("read");
        assert_eq!(seen, "HTTP/1.1 200 OK\r\n");
    }
}
