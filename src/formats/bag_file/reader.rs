//! Messages of a bag as a stream: chunk after chunk, each with a decompressor of its own.

use super::record::{RecordFault, RecordHeader, field, op, read_data};
use crate::FormatError;
use crate::chunk_records::{ChunkCompression, ChunkRecords, buffer_size, skip_bytes};
use crate::messages::{ContainerStep, MAX_RECORD, MessageContainer, MessageHead, TopicChannel};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// First line of a bag.
const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// Largest connection record, bytes: message definitions have some kilobytes.
const MAX_CONNECTION: usize = 4 << 20;
/// ROS 1 bag, read record by record. Its index is not used, so unindexed bags are read too.
pub(crate) struct BagMessages {
    path: PathBuf,
    /// Shares its position with the chunk being read, and seeks after it.
    file: BufReader<File>,
    /// Bytes of the file.
    length: u64,
    /// Position of the next record of the file.
    next: u64,
    chunk: Option<ChunkRecords>,
    channels: BTreeMap<u32, Arc<TopicChannel>>,
    buffer: Vec<u8>,
    messages: u64,
    is_ended: bool,
    is_cut_short: bool,
}

impl BagMessages {
    /// Opens a bag at its start.
    ///
    /// # Errors
    /// Those of the system, or another first line.
    pub(crate) fn open(path: &Path) -> Result<Box<dyn MessageContainer>, FormatError> {
        let io = |e| FormatError::io(path, e);
        let file = File::open(path).map_err(io)?;
        let length = file.metadata().map_err(io)?.len();
        let mut file = BufReader::with_capacity(buffer_size(length), file);
        let mut magic = Vec::new();
        let first = (&mut file).take(MAGIC.len() as u64).read_to_end(&mut magic);
        first.map_err(io)?;
        if magic != MAGIC {
            let why = "expected the first line `#ROSBAG V2.0`";
            return Err(FormatError::field(path, "magic", why));
        }
        Ok(Box::new(Self {
            path: path.to_owned(),
            file,
            length,
            next: MAGIC.len() as u64,
            chunk: None,
            channels: BTreeMap::new(),
            buffer: Vec::new(),
            messages: 0,
            is_ended: false,
            is_cut_short: false,
        }))
    }

    fn read_step(
        &mut self,
        is_wanted: &dyn Fn(&TopicChannel) -> bool,
        data: &mut Vec<u8>,
    ) -> Result<ContainerStep, RecordFault> {
        let Some(mut chunk) = self.chunk.take() else {
            return self.file_record(is_wanted, data);
        };
        let is_whole = self.next <= self.length;
        let step = match RecordHeader::read(&mut chunk) {
            Ok(None) => {
                self.file.seek(SeekFrom::Start(self.next))?;
                return Ok(ContainerStep::Other);
            }
            Ok(Some(header)) => self.record(&header, &mut chunk, is_wanted, data),
            Err(fault) => Err(fault),
        };
        self.chunk = Some(chunk);
        step.map_err(|fault| match fault {
            RecordFault::CutShort if is_whole => {
                RecordFault::Field("chunk", "damaged: fewer bytes than it states".into())
            }
            other => other,
        })
    }

    /// Reads a record of the file itself; chunks are opened, indices skipped.
    fn file_record(
        &mut self,
        is_wanted: &dyn Fn(&TopicChannel) -> bool,
        data: &mut Vec<u8>,
    ) -> Result<ContainerStep, RecordFault> {
        if self.next > self.length {
            return Err(RecordFault::CutShort);
        }
        let Some(header) = RecordHeader::read(&mut self.file)? else {
            return Ok(ContainerStep::End);
        };
        let start = self.file.stream_position()?;
        self.next = start + header.data_length;
        if header.number("op")? == [op::CHUNK] {
            self.chunk = Some(self.open_chunk(&header, start)?);
            return Ok(ContainerStep::Other);
        }
        let mut from = self.file.get_ref().try_clone()?;
        from.seek(SeekFrom::Start(start))?;
        let step = self.record(&header, &mut from, is_wanted, data);
        self.file.seek(SeekFrom::Start(self.next))?;
        step
    }

    fn open_chunk(&self, header: &RecordHeader, start: u64) -> Result<ChunkRecords, RecordFault> {
        let mut file = self.file.get_ref().try_clone()?;
        file.seek(SeekFrom::Start(start))?;
        let bytes = BufReader::with_capacity(buffer_size(header.data_length), file)
            .take(header.data_length);
        let size = u32::from_le_bytes(header.number("size")?);
        let compression = match header.field("compression")? {
            b"none" => ChunkCompression::Stored,
            b"bz2" => ChunkCompression::Bz2,
            b"lz4" => ChunkCompression::Lz4,
            other => {
                let name = String::from_utf8_lossy(other);
                let why = format!("`{name}`, expected none, bz2 or lz4");
                return Err(RecordFault::Field("compression", why));
            }
        };
        Ok(ChunkRecords::new(compression, size.into(), bytes)?)
    }

    /// Reads the data of a connection or a message; skips those of other records.
    fn record(
        &mut self,
        header: &RecordHeader,
        from: &mut dyn Read,
        is_wanted: &dyn Fn(&TopicChannel) -> bool,
        data: &mut Vec<u8>,
    ) -> Result<ContainerStep, RecordFault> {
        let length = header.data_length;
        match header.number("op")? {
            [op::CONNECTION] => {
                read_data(from, length, MAX_CONNECTION, &mut self.buffer)?;
                self.add_connection(header)?;
            }
            [op::MESSAGE] => {
                self.messages += 1;
                let connection = u32::from_le_bytes(header.number("conn")?);
                let channel = self.channels.get(&connection).cloned();
                if let Some(channel) = channel.filter(|c| is_wanted(c)) {
                    let [seconds, nanoseconds] = header.number::<8>("time").map(halves)?;
                    read_data(from, length, MAX_RECORD, data)?;
                    return Ok(ContainerStep::Message(MessageHead {
                        channel,
                        sequence: 0,
                        log_time_ns: seconds * 1_000_000_000 + nanoseconds,
                        number: self.messages,
                    }));
                }
                skip_bytes(from, length)?;
            }
            _ => skip_bytes(from, length)?,
        }
        Ok(ContainerStep::Other)
    }

    /// Adds the connection whose data are in the buffer.
    fn add_connection(&mut self, header: &RecordHeader) -> Result<(), RecordFault> {
        let id = u32::from_le_bytes(header.number("conn")?);
        let topic = String::from_utf8_lossy(header.field("topic")?);
        let schema = String::from_utf8_lossy(field(&self.buffer, "type")?);
        let channel = TopicChannel::new(&topic, &schema, "ros1");
        if self.channels.get(&id).is_none_or(|c| **c != channel) {
            self.channels.insert(id, Arc::new(channel));
        }
        Ok(())
    }

    /// Ends the stream: silently where the file does after its first message, else with an error.
    fn end(&mut self, fault: RecordFault) -> Result<(), FormatError> {
        self.is_ended = true;
        let at = |field: &str| format!("after message {}, {field}", self.messages);
        match fault {
            RecordFault::CutShort if self.messages > 0 => {
                self.is_cut_short = true;
                Ok(())
            }
            RecordFault::CutShort => {
                let why = "the file is cut short";
                Err(FormatError::field(&self.path, at("record"), why))
            }
            RecordFault::Field(field, why) => Err(FormatError::field(&self.path, at(field), why)),
            RecordFault::Io(e) => {
                let why = format!("damaged ({e})");
                Err(FormatError::field(&self.path, at("chunk"), why))
            }
        }
    }
}

/// Two little-endian words: seconds and nanoseconds.
fn halves(bytes: [u8; 8]) -> [u64; 2] {
    let value = u64::from_le_bytes(bytes);
    [value & u64::from(u32::MAX), value >> 32]
}

impl MessageContainer for BagMessages {
    fn step(
        &mut self,
        is_wanted: &dyn Fn(&TopicChannel) -> bool,
        data: &mut Vec<u8>,
    ) -> Result<ContainerStep, FormatError> {
        if self.is_ended {
            return Ok(ContainerStep::End);
        }
        match self.read_step(is_wanted, data) {
            Ok(step) => {
                self.is_ended = matches!(step, ContainerStep::End);
                Ok(step)
            }
            Err(fault) => self.end(fault).map(|()| ContainerStep::End),
        }
    }
    fn channels(&self) -> Vec<Arc<TopicChannel>> {
        self.channels.values().cloned().collect()
    }
    fn is_cut_short(&self) -> bool {
        self.is_cut_short
    }
}
