//! Bytes of messages on one HTTP/2 connection, sent and granted back by its reader's WINDOW_UPDATEs (RFC 9113, 6.9).

use super::frames::{DATA, HEADERS, Head, Part, RST_STREAM, WINDOW_UPDATE};
use crate::queue::consumption::Consumption;
use std::collections::HashMap;

/// Bytes of a stream that may be granted beyond those sent. grpc-core grants a message ahead and less afterwards; more is
/// a window that grows.
const AHEAD: u64 = 1 << 20;

/// Bytes of one stream.
#[derive(Clone, Copy, Default)]
struct Stream {
    sent: u64,
    granted: u64,
}

/// Streams on which this side sends.
pub(super) struct Ledger {
    streams: HashMap<u32, Stream>,
    total: Consumption,
}

impl Ledger {
    pub(super) fn new(total: Consumption) -> Self {
        Self {
            streams: HashMap::new(),
            total,
        }
    }

    /// A part of a frame was written.
    pub(super) fn on_sent(&mut self, part: Part) {
        match part {
            // Not with DATA: the rest of a frame may follow the reader's RST_STREAM.
            Part::Head(head) if head.kind == HEADERS => {
                self.streams.entry(head.stream).or_default();
            }
            Part::Payload(head, n) if head.kind == DATA => {
                if let Some(s) = self.streams.get_mut(&head.stream) {
                    s.sent += n as u64;
                    self.total.send(n as u64);
                }
            }
            Part::End(head, _) if head.ends_stream() => self.end(head),
            _ => (),
        }
    }

    /// A part of a frame was read.
    pub(super) fn on_received(&mut self, part: Part) {
        match part {
            Part::End(head, [a, b, c, d, ..]) if head.kind == WINDOW_UPDATE => {
                let increment = u32::from_be_bytes([a, b, c, d]) & (u32::MAX >> 1);
                self.grant(head.stream, increment);
            }
            // The caller's own END_STREAM leaves the answer open.
            Part::End(head, _) if head.kind == RST_STREAM => self.end(head),
            _ => (),
        }
    }

    /// Streams without a byte sent have nothing to grant: such an update enlarges a window.
    fn grant(&mut self, stream: u32, increment: u32) {
        if let Some(s) = self.streams.get_mut(&stream) {
            let granted = (s.granted + u64::from(increment)).min(s.sent + AHEAD);
            let gained = granted - s.granted;
            s.granted = granted;
            self.total.grant(gained, increment);
        }
    }

    /// Nobody grants bytes of a stream that has ended: the rest counts as granted.
    fn end(&mut self, head: Head) {
        if let Some(s) = self.streams.remove(&head.stream) {
            self.total.settle(s.sent, s.granted);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::frames::END_STREAM;
    use super::*;

    fn head(kind: u8, flags: u8, stream: u32) -> Head {
        Head {
            length: 0,
            kind,
            flags,
            stream,
        }
    }

    /// A ledger whose stream 3 has sent so many bytes.
    fn ledger(sent: usize) -> (Ledger, Consumption) {
        let total = Consumption::default();
        let mut ledger = Ledger::new(total.clone());
        ledger.on_sent(Part::Head(head(HEADERS, 0, 3)));
        ledger.on_sent(Part::Payload(head(DATA, 0, 3), sent));
        (ledger, total)
    }

    fn update(stream: u32, increment: u32) -> Part {
        let mut kept = [0; 8];
        kept[..4].copy_from_slice(&increment.to_be_bytes());
        Part::End(head(WINDOW_UPDATE, 0, stream), kept)
    }

    /// Bytes sent and granted.
    fn sums(total: &Consumption) -> (u64, u64) {
        let counts = *total.counts().borrow();
        (counts.sent, counts.granted)
    }

    #[test]
    fn updates_of_a_stream_are_grants_and_others_are_not() {
        let (mut ledger, total) = ledger(1000);
        ledger.on_sent(Part::Payload(head(HEADERS, 0, 3), 70));
        // The connection's window, a stream that has sent nothing, a reserved bit.
        for (stream, increment) in [(0, 500), (5, 500), (3, 1 << 31 | 400)] {
            ledger.on_received(update(stream, increment));
        }
        assert_eq!(sums(&total), (1000, 400));
    }

    #[test]
    fn growth_of_a_window_is_no_consumption() {
        let (mut ledger, total) = ledger(1000);
        for _ in 0..5 {
            ledger.on_received(update(3, u32::MAX >> 1));
        }
        assert_eq!(sums(&total), (1000, 1000 + AHEAD));
        ledger.on_received(Part::End(head(RST_STREAM, 0, 3), [0; 8]));
        assert_eq!(sums(&total), (1000, 1000), "growth ends with its stream");
    }

    #[test]
    fn the_end_of_a_stream_grants_the_rest() {
        for kind in [DATA, HEADERS, RST_STREAM] {
            let (mut ledger, total) = ledger(1000);
            ledger.on_received(update(3, 300));
            ledger.on_sent(Part::End(head(DATA, 0, 3), [0; 8]));
            ledger.on_received(Part::End(head(DATA, END_STREAM, 3), [0; 8]));
            assert_eq!(sums(&total), (1000, 300));
            ledger.on_sent(Part::End(head(kind, END_STREAM, 3), [0; 8]));
            ledger.on_received(update(3, 300));
            ledger.on_sent(Part::Payload(head(DATA, 0, 3), 50));
            assert_eq!((sums(&total), ledger.streams.len()), ((1000, 1000), 0));
        }
    }
}
