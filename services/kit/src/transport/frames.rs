//! Frames of HTTP/2 (RFC 9113) in the bytes of one direction of a connection, wherever reads and writes cut them.

/// Begin of every connection of HTTP/2.
pub(super) const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
pub(super) const HEAD: usize = 9;
/// Types of frames.
pub(super) const DATA: u8 = 0;
pub(super) const HEADERS: u8 = 1;
pub(super) const RST_STREAM: u8 = 3;
pub(super) const SETTINGS: u8 = 4;
pub(super) const PING: u8 = 6;
pub(super) const WINDOW_UPDATE: u8 = 8;
/// Flag of the last DATA or HEADERS of a stream.
pub(super) const END_STREAM: u8 = 1;
/// Flag of the answer to a PING.
pub(super) const ACK: u8 = 1;
/// Bytes of a payload that are kept: those of a PING; a WINDOW_UPDATE has fewer.
const KEPT: usize = 8;

/// Head of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Head {
    pub(super) length: usize,
    pub(super) kind: u8,
    pub(super) flags: u8,
    pub(super) stream: u32,
}

impl Head {
    fn parse(b: [u8; HEAD]) -> Self {
        Self {
            length: u32::from_be_bytes([0, b[0], b[1], b[2]]) as usize,
            kind: b[3],
            flags: b[4],
            // The highest bit is reserved.
            stream: u32::from_be_bytes([b[5], b[6], b[7], b[8]]) & (u32::MAX >> 1),
        }
    }

    /// The sender closes its end of the stream with this frame.
    pub(super) fn ends_stream(&self) -> bool {
        let is_closing = matches!(self.kind, DATA | HEADERS) && self.flags & END_STREAM != 0;
        is_closing || self.kind == RST_STREAM
    }
}

/// Part of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// A head is complete.
    Head(Head),
    /// Bytes of the payload, by number.
    Payload(Head, usize),
    /// The frame is complete; first bytes of its payload, zeros beyond its length.
    End(Head, [u8; KEPT]),
}

enum Position {
    /// Bytes of the preface that were read.
    Preface(usize),
    /// Head of a frame, and its bytes that were read.
    Head([u8; HEAD], usize),
    /// Bytes of a payload that are still to come.
    Payload(usize),
    /// Not HTTP/2.
    Other,
}

/// Parser of one direction.
pub(super) struct Frames {
    position: Position,
    head: Head,
    kept: [u8; KEPT],
    /// The next frame must be SETTINGS: what a server sends is not HTTP/2 otherwise.
    is_first: bool,
}

impl Frames {
    fn new(position: Position, is_first: bool) -> Self {
        Self {
            position,
            head: Head::default(),
            kept: [0; KEPT],
            is_first,
        }
    }

    /// Frames that a client sends.
    pub(super) fn of_client() -> Self {
        Self::new(Position::Preface(0), false)
    }

    /// Frames that a server sends.
    pub(super) fn of_server() -> Self {
        Self::new(Position::Head([0; HEAD], 0), true)
    }

    /// HTTP/2 is spoken, and the next byte begins a frame.
    pub(super) fn is_between(&self) -> bool {
        matches!(self.position, Position::Head(_, 0)) && !self.is_first
    }

    /// Calls `on` for each part of a frame in `bytes`, with the index of the byte after it.
    pub(super) fn read(&mut self, bytes: &[u8], mut on: impl FnMut(Part, usize)) {
        let mut at = 0;
        while at < bytes.len() {
            at += self.step(&bytes[at..], |part, n| on(part, at + n));
        }
    }

    /// Reads to the end of a head or of a payload at most; the number of bytes read.
    fn step(&mut self, bytes: &[u8], mut on: impl FnMut(Part, usize)) -> usize {
        match &mut self.position {
            Position::Preface(at) => {
                let n = bytes.len().min(PREFACE.len() - *at);
                *at += n;
                if bytes[..n] != PREFACE[*at - n..*at] {
                    self.position = Position::Other;
                } else if *at == PREFACE.len() {
                    self.position = Position::Head([0; HEAD], 0);
                }
                n
            }
            Position::Head(head, at) => {
                let n = bytes.len().min(HEAD - *at);
                head[*at..*at + n].copy_from_slice(&bytes[..n]);
                *at += n;
                if *at == HEAD {
                    let head = Head::parse(*head);
                    self.begin(head);
                    if !matches!(self.position, Position::Other) {
                        on(Part::Head(head), n);
                        self.end_if_complete(|part| on(part, n));
                    }
                }
                n
            }
            Position::Payload(left) => {
                let n = bytes.len().min(*left);
                let from = self.head.length - *left;
                *left -= n;
                for (kept, b) in self.kept.iter_mut().skip(from).zip(&bytes[..n]) {
                    *kept = *b;
                }
                on(Part::Payload(self.head, n), n);
                self.end_if_complete(|part| on(part, n));
                n
            }
            Position::Other => bytes.len(),
        }
    }

    fn begin(&mut self, head: Head) {
        let is_other = self.is_first && head.kind != SETTINGS;
        self.position = if is_other {
            Position::Other
        } else {
            Position::Payload(head.length)
        };
        (self.head, self.kept, self.is_first) = (head, [0; KEPT], false);
    }

    fn end_if_complete(&mut self, on: impl FnOnce(Part)) {
        if matches!(self.position, Position::Payload(0)) {
            self.position = Position::Head([0; HEAD], 0);
            on(Part::End(self.head, self.kept));
        }
    }
}

/// A frame with zeros as payload.
#[cfg(test)]
pub(super) fn frame(kind: u8, flags: u8, stream: u32, length: usize) -> Vec<u8> {
    let mut f = (length as u32).to_be_bytes()[1..].to_vec();
    f.extend([kind, flags]);
    f.extend(stream.to_be_bytes());
    f.resize(HEAD + length, 0);
    f
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Complete frames and bytes of DATA in `stream`, read in pieces of `cut` bytes.
    fn parts(mut frames: Frames, stream: &[u8], cut: usize) -> (Vec<(u8, u32, [u8; KEPT])>, usize) {
        let (mut ends, mut data) = (Vec::new(), 0);
        for piece in stream.chunks(cut) {
            frames.read(piece, |part, at| {
                assert!(at <= piece.len());
                match part {
                    Part::Head(_) => (),
                    Part::Payload(h, n) => data += if h.kind == DATA { n } else { 0 },
                    Part::End(h, kept) => ends.push((h.kind, h.stream, kept)),
                }
            });
        }
        (ends, data)
    }

    #[test]
    fn frames_are_found_wherever_reads_are_cut() {
        let mut update = frame(WINDOW_UPDATE, 0, 3, 4);
        update[HEAD..].copy_from_slice(&[0, 1, 2, 3]);
        let frames = [
            frame(SETTINGS, 0, 0, 18),
            frame(HEADERS, 0, 3, 300),
            update,
            frame(DATA, 0, 3, 900),
            frame(DATA, END_STREAM, 1 << 31 | 3, 0),
        ];
        let server = frames.concat();
        let client = [PREFACE, &server].concat();
        let wanted = [
            (SETTINGS, 0, [0; 8]),
            (HEADERS, 3, [0; 8]),
            (WINDOW_UPDATE, 3, [0, 1, 2, 3, 0, 0, 0, 0]),
            (DATA, 3, [0; 8]),
            (DATA, 3, [0; 8]),
        ];
        for cut in 1..client.len() {
            let found = parts(Frames::of_client(), &client, cut);
            assert_eq!(found, (wanted.to_vec(), 900), "{cut}");
            let found = parts(Frames::of_server(), &server, cut);
            assert_eq!(found, (wanted.to_vec(), 900), "{cut}");
        }
    }

    #[test]
    fn http1_has_no_frames() {
        for cut in [1, 5, 100] {
            let client = parts(Frames::of_client(), b"PRI * HTTP/1.1\r\n\0\0\0\0\0\0", cut);
            let server = parts(Frames::of_server(), b"HTTP/1.1 200 OK\r\n\0\0\0\0\0", cut);
            assert_eq!((client, server), ((vec![], 0), (vec![], 0)));
        }
    }
}
