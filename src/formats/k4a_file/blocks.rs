//! Blocks of a Matroska file in its order: position and time of each frame, without its bytes.

use super::ebml::{ElementHeader, MAX_HEADER, unsigned, variable};
use super::header::{MatroskaHeader, element_at, id, payload_at};
use crate::FormatError;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

const TIMESTAMP: u32 = 0xe7;
const SIMPLE_BLOCK: u32 = 0xa3;
const BLOCK_GROUP: u32 = 0xa0;
const BLOCK: u32 = 0xa1;

/// Bits of a block's flags that state several frames in one block.
const LACING: u8 = 0x06;
/// Longest start of a block, bytes: track number, time and flags.
const BLOCK_START: u64 = 8 + 2 + 1;
/// Bytes searched at a time for the next cluster after damage.
const SEARCH_WINDOW: usize = 1 << 16;

/// A frame in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BlockLocation {
    /// Number of its track.
    pub(super) track: u64,
    /// Time since the start of the recording, nanoseconds.
    pub(super) time_ns: u64,
    /// First byte of the frame.
    pub(super) at: u64,
    /// Bytes of the frame.
    pub(super) size: u64,
}

/// Cursor over the blocks of a file.
#[derive(Debug)]
pub(super) struct BlockScanner {
    path: PathBuf,
    file: File,
    length: u64,
    tick_ns: u64,
    first_cluster: u64,
    at: u64,
    cluster_ticks: u64,
}

impl BlockScanner {
    /// Starts at the first cluster.
    ///
    /// # Errors
    /// When the file's length cannot be queried.
    pub(super) fn new(
        path: &Path,
        file: File,
        header: &MatroskaHeader,
    ) -> Result<Self, FormatError> {
        let length = file.metadata().map_err(|e| FormatError::io(path, e))?.len();
        Ok(Self {
            path: path.to_owned(),
            file,
            length,
            tick_ns: header.tick_ns,
            first_cluster: header.first_cluster,
            at: header.first_cluster,
            cluster_ticks: 0,
        })
    }

    /// Returns to the first cluster.
    pub(super) fn rewind(&mut self) {
        self.at = self.first_cluster;
        self.cluster_ticks = 0;
    }

    /// The next block of any track; `None` at the end of the file. After an error it continues at the next cluster.
    ///
    /// # Errors
    /// Damaged structure, or a last block that is cut short.
    pub(super) fn next_block(&mut self) -> Result<Option<BlockLocation>, FormatError> {
        while self.at < self.length {
            let start = self.at;
            let element = element_at(&mut self.file, start).map_err(|e| self.io(e))?;
            match element.map(|element| self.enter(element)) {
                Some(Ok(None)) => {}
                Some(Ok(block)) => return Ok(block),
                Some(Err(why)) => return Err(self.damage(start, &why)),
                None => return Err(self.damage(start, "no element begins here")),
            }
        }
        Ok(None)
    }

    /// Bytes of a frame.
    ///
    /// # Errors
    /// When the file cannot be read or ends before.
    pub(super) fn read(&mut self, block: &BlockLocation) -> Result<Vec<u8>, FormatError> {
        let bytes = payload_at(&mut self.file, block.at, block.size).map_err(|e| self.io(e))?;
        if bytes.len() as u64 == block.size {
            return Ok(bytes);
        }
        let why = format!("cut short: {} of {} bytes", bytes.len(), block.size);
        Err(self.fault(block.at, &why))
    }

    fn io(&self, why: std::io::Error) -> FormatError {
        FormatError::io(&self.path, why)
    }

    fn fault(&self, at: u64, why: &str) -> FormatError {
        FormatError::field(&self.path, format!("byte {at}"), why)
    }

    /// Error at `start`, after a search for the next cluster.
    fn damage(&mut self, start: u64, why: &str) -> FormatError {
        self.at = match self.next_cluster(start.saturating_add(1)) {
            Ok(at) => at,
            Err(e) => return self.io(e),
        };
        self.fault(start, why)
    }

    /// Position of the next cluster from `at` on, by its identifier; the file's length without one.
    fn next_cluster(&mut self, mut at: u64) -> std::io::Result<u64> {
        self.at = self.length;
        let wanted = id::CLUSTER.to_be_bytes();
        let overlap = wanted.len() - 1;
        let mut window = Vec::with_capacity(SEARCH_WINDOW);
        loop {
            self.file.seek(SeekFrom::Start(at))?;
            window.clear();
            let read = (&mut self.file)
                .take(SEARCH_WINDOW as u64)
                .read_to_end(&mut window)?;
            if let Some(i) = window.windows(wanted.len()).position(|w| w == wanted) {
                return Ok(at + i as u64);
            }
            if read < SEARCH_WINDOW {
                return Ok(self.length);
            }
            at += (read - overlap) as u64;
        }
    }

    /// Moves into a cluster or group, or past any other element; returns the block that it is.
    fn enter(&mut self, element: ElementHeader) -> Result<Option<BlockLocation>, String> {
        let payload = self.at + element.length;
        if matches!(element.id, id::CLUSTER | BLOCK_GROUP | id::SEGMENT) {
            self.at = payload;
            return Ok(None);
        }
        let Some(size) = element.size else {
            return Err(format!("element {:#x} has no size", element.id));
        };
        let left = self.length.saturating_sub(payload);
        if size > left {
            return Err(format!(
                "cut short: element {:#x} has {left} of {size} bytes",
                element.id
            ));
        }
        self.at = payload + size;
        let start = match element.id {
            TIMESTAMP => size.min(MAX_HEADER as u64),
            SIMPLE_BLOCK | BLOCK => size.min(BLOCK_START),
            _ => return Ok(None),
        };
        let bytes = payload_at(&mut self.file, payload, start).map_err(|e| e.to_string())?;
        if element.id == TIMESTAMP {
            self.cluster_ticks = unsigned(&bytes).ok_or("a time of more than eight bytes")?;
            return Ok(None);
        }
        self.block(&bytes, payload, size).map(Some)
    }

    /// Block of `size` bytes at `payload`, from its first bytes.
    fn block(&self, bytes: &[u8], payload: u64, size: u64) -> Result<BlockLocation, String> {
        let (track, length) = variable(bytes).ok_or("a block without a track")?;
        let Some(&[high, low, flags]) = bytes.get(length..length + 3) else {
            return Err("a block without a time".to_owned());
        };
        if flags & LACING != 0 {
            // Only tracks of small packets lace; their blocks are of no use here.
            return Ok(BlockLocation {
                track: 0,
                time_ns: 0,
                at: payload,
                size: 0,
            });
        }
        let offset = i64::from(i16::from_be_bytes([high, low]));
        let ticks = self.cluster_ticks.saturating_add_signed(offset);
        let start = length as u64 + 3;
        Ok(BlockLocation {
            track: track.unwrap_or(0),
            time_ns: ticks.saturating_mul(self.tick_ns),
            at: payload + start,
            size: size - start,
        })
    }
}
