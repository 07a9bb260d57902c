//! A video node: its formats, and its images once it streams.

use super::abi::{
    self, BUFFER_ERROR, Buffer, CAP_CAPTURE, CAP_DEVICE_CAPS, CAP_STREAMING, CAPTURE, Capability,
    DISCRETE, Format, FormatDescription, FrameInterval, FrameSize, MEMORY_MMAP, RequestBuffers,
    StreamParameters, fourcc,
};
use super::kernel::{Mapped, send, stream, zeroed};
use crate::Stream;
use crate::driver::{Encoding, StreamFormat};
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

/// Buffers of a stream: one that the driver fills, one that is copied, two for a late reader.
const BUFFERS: u32 = 4;
/// Most entries of a list: drivers that never end theirs are broken.
const MAX_LIST: u32 = 64;

/// Pixel formats that are read, the preferred first.
const KNOWN: [(Stream, u32, Encoding); 4] = [
    (Stream::Depth, fourcc(b"Z16 "), Encoding::Depth16),
    (Stream::Color, fourcc(b"YUYV"), Encoding::Yuyv),
    (Stream::Color, fourcc(b"UYVY"), Encoding::Uyvy),
    (Stream::Color, fourcc(b"MJPG"), Encoding::Jpeg),
];

/// A mode of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NodeMode {
    pub(super) stream: Stream,
    pub(super) format: StreamFormat,
}

/// An open node.
pub(super) struct VideoNode {
    file: File,
}

/// Entries of a list whose end the driver states by an error.
fn entries<T>(mut entry: impl FnMut(u32) -> io::Result<T>) -> Vec<T> {
    (0..MAX_LIST).map_while(|i| entry(i).ok()).collect()
}

impl VideoNode {
    /// Opens a node that delivers images.
    ///
    /// # Errors
    /// The system's, and nodes of metadata or output.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let mut options = OpenOptions::new();
        options
            .read(true)
            .write(true)
            .custom_flags(libc::O_NONBLOCK);
        let file = options.open(path)?;
        let mut can: Capability = zeroed();
        send(&file, abi::QUERYCAP, &mut can)?;
        let flags = if can.capabilities & CAP_DEVICE_CAPS == 0 {
            can.capabilities
        } else {
            can.device_caps
        };
        let needed = CAP_CAPTURE | CAP_STREAMING;
        if flags & needed != needed {
            return Err(io::ErrorKind::Unsupported.into());
        }
        Ok(Self { file })
    }

    pub(super) fn file(&self) -> &File {
        &self.file
    }

    /// Modes that are read, the preferred format first.
    pub(super) fn modes(&self) -> Vec<NodeMode> {
        let offered = entries(|index| {
            let mut entry = FormatDescription {
                index,
                kind: CAPTURE,
                ..zeroed()
            };
            send(&self.file, abi::ENUM_FMT, &mut entry).map(|()| entry.pixel_format)
        });
        let known = KNOWN.iter().filter(|(_, code, _)| offered.contains(code));
        let modes = known.flat_map(|(stream, code, encoding)| {
            let sizes = self.sizes(*code).into_iter();
            sizes.flat_map(move |[width, height]| {
                let rates = self.rates(*code, [width, height]).into_iter();
                rates.map(move |rate| NodeMode {
                    stream: *stream,
                    format: StreamFormat {
                        encoding: *encoding,
                        width,
                        height,
                        rate,
                    },
                })
            })
        });
        modes.collect()
    }

    fn sizes(&self, pixel_format: u32) -> Vec<[u32; 2]> {
        let all = entries(|index| {
            let mut entry = FrameSize {
                index,
                pixel_format,
                ..zeroed()
            };
            send(&self.file, abi::ENUM_FRAMESIZES, &mut entry).map(|()| entry)
        });
        let discrete = all.into_iter().filter(|s| s.kind == DISCRETE);
        discrete.map(|s| [s.width, s.height]).collect()
    }

    fn rates(&self, pixel_format: u32, [width, height]: [u32; 2]) -> Vec<f64> {
        let all = entries(|index| {
            let mut entry = FrameInterval {
                index,
                pixel_format,
                width,
                height,
                ..zeroed()
            };
            send(&self.file, abi::ENUM_FRAMEINTERVALS, &mut entry).map(|()| entry)
        });
        let timed = all
            .into_iter()
            .filter(|i| i.kind == DISCRETE && i.numerator > 0);
        timed
            .map(|i| f64::from(i.denominator) / f64::from(i.numerator))
            .collect()
    }

    /// Starts the images of a mode.
    ///
    /// # Errors
    /// The kernel's: the node is busy, or the camera has gone; or the driver answers with another format.
    pub(super) fn start(self, mode: &NodeMode) -> io::Result<Streaming> {
        let format = &mode.format;
        let is_it =
            |(s, _, e): &&(Stream, u32, Encoding)| (*s, *e) == (mode.stream, format.encoding);
        let (_, code, _) = KNOWN.iter().find(is_it).ok_or(io::ErrorKind::Unsupported)?;
        let mut set: Format = zeroed();
        (set.kind, set.pixel_format) = (CAPTURE, *code);
        (set.width, set.height) = (format.width, format.height);
        send(&self.file, abi::S_FMT, &mut set)?;
        if (set.width, set.height, set.pixel_format) != (format.width, format.height, *code) {
            return Err(io::Error::other("the driver answers with another format"));
        }
        let mut rate: StreamParameters = zeroed();
        rate.kind = CAPTURE;
        (rate.numerator, rate.denominator) = (1, format.rate.round() as u32);
        // Cameras of one rate refuse it.
        let _ = send(&self.file, abi::S_PARM, &mut rate);
        let mut asked = RequestBuffers {
            count: BUFFERS,
            kind: CAPTURE,
            memory: MEMORY_MMAP,
            ..zeroed()
        };
        send(&self.file, abi::REQBUFS, &mut asked)?;
        let buffers = (0..asked.count.min(MAX_LIST)).map(|i| Mapped::new(&self.file, i));
        let streaming = Streaming {
            buffers: buffers.collect::<Result<_, _>>()?,
            bytes_per_line: set.bytes_per_line,
            node: self,
        };
        for index in 0..asked.count {
            streaming.give_back(index)?;
        }
        stream(&streaming.node.file, true)?;
        Ok(streaming)
    }
}

/// A node whose images run. Dropping it ends them.
pub(super) struct Streaming {
    buffers: Vec<Mapped>,
    /// Bytes from row to row; 0 for compressed images.
    pub(super) bytes_per_line: u32,
    pub(super) node: VideoNode,
}

/// An image of a node.
pub(super) struct NodeImage {
    /// Capture time on the system's monotonic clock, nanoseconds.
    pub(super) time_ns: u64,
    pub(super) bytes: Vec<u8>,
}

impl Streaming {
    fn give_back(&self, index: u32) -> io::Result<()> {
        let mut buffer = Buffer {
            index,
            kind: CAPTURE,
            memory: MEMORY_MMAP,
            ..zeroed()
        };
        send(&self.node.file, abi::QBUF, &mut buffer)
    }

    /// The image that waits, if any. Images that the driver marks as damaged are left out.
    ///
    /// # Errors
    /// The kernel's: the camera has gone.
    pub(super) fn read(&self) -> io::Result<Option<NodeImage>> {
        let mut buffer = Buffer {
            kind: CAPTURE,
            memory: MEMORY_MMAP,
            ..zeroed()
        };
        match send(&self.node.file, abi::DQBUF, &mut buffer) {
            Err(e) if e.kind() == io::ErrorKind::WouldBlock => return Ok(None),
            other => other?,
        }
        let mapped = self.buffers.get(buffer.index as usize);
        let mapped = mapped.ok_or_else(|| io::Error::other("a buffer that does not exist"))?;
        let is_damaged = buffer.flags & BUFFER_ERROR != 0 || buffer.bytes_used == 0;
        let image = (!is_damaged).then(|| NodeImage {
            time_ns: nanoseconds(&buffer),
            bytes: mapped.copy(buffer.bytes_used),
        });
        self.give_back(buffer.index)?;
        Ok(image)
    }
}

fn nanoseconds(buffer: &Buffer) -> u64 {
    let [seconds, microseconds] =
        [buffer.seconds, buffer.microseconds].map(|t| u64::try_from(t).unwrap_or(0));
    seconds * 1_000_000_000 + microseconds * 1000
}

impl Drop for Streaming {
    fn drop(&mut self) {
        // Fails once the camera has gone, and then nothing streams.
        let _ = stream(&self.node.file, false);
    }
}
