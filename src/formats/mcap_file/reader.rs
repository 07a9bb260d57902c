//! Messages of an MCAP file as a stream: chunk after chunk, each with a decompressor of its own.

use super::chunk::{self, McapFault};
use super::record::{MESSAGE_HEADER, McapRecord};
use crate::FormatError;
use crate::chunk_records::{ChunkRecords, buffer_size, read_bytes, skip_bytes};
use crate::messages::{ContainerStep, MAX_RECORD, MessageContainer, MessageHead, TopicChannel};
use mcap::records::op;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// MCAP file, read record by record up to its summary. Its index is not used, so files without one are read too.
pub(crate) struct McapMessages {
    path: PathBuf,
    /// Shares its position with the chunk being read, and seeks after it.
    file: BufReader<File>,
    /// Bytes of the file.
    length: u64,
    /// Position of the next record of the file.
    next: u64,
    chunk: Option<ChunkRecords>,
    /// Names of schemas by number.
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Arc<TopicChannel>>,
    buffer: Vec<u8>,
    messages: u64,
    is_ended: bool,
    is_cut_short: bool,
}

/// Code and length of a record.
#[derive(Clone, Copy, Debug)]
struct RecordPrefix {
    opcode: u8,
    /// Bytes of its content.
    length: u64,
}

impl RecordPrefix {
    /// Reads a prefix; `None` at the end.
    fn read(from: &mut dyn Read) -> Result<Option<Self>, McapFault> {
        let mut bytes = [0; 9];
        if from.read(&mut bytes[..1])? == 0 {
            return Ok(None);
        }
        from.read_exact(&mut bytes[1..])?;
        let [opcode, length @ ..] = bytes;
        Ok(Some(Self {
            opcode,
            length: u64::from_le_bytes(length),
        }))
    }
    fn field(self, part: &str) -> String {
        format!("record 0x{:02x}.{part}", self.opcode)
    }
}

impl McapMessages {
    /// Opens a file at its start.
    ///
    /// # Errors
    /// Those of the system, or another magic.
    pub(crate) fn open(path: &Path) -> Result<Box<dyn MessageContainer>, FormatError> {
        let io = |e| FormatError::io(path, e);
        let file = File::open(path).map_err(io)?;
        let length = file.metadata().map_err(io)?.len();
        let mut file = BufReader::with_capacity(buffer_size(length), file);
        let mut magic = Vec::new();
        let mut first = (&mut file).take(mcap::MAGIC.len() as u64);
        first.read_to_end(&mut magic).map_err(io)?;
        if magic != mcap::MAGIC {
            let why = "expected that of MCAP, version 0";
            return Err(FormatError::field(path, "magic", why));
        }
        Ok(Box::new(Self {
            path: path.to_owned(),
            file,
            length,
            next: mcap::MAGIC.len() as u64,
            chunk: None,
            schemas: BTreeMap::new(),
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
    ) -> Result<ContainerStep, McapFault> {
        let Some(mut chunk) = self.chunk.take() else {
            return self.file_record(is_wanted, data);
        };
        let step = match RecordPrefix::read(&mut chunk) {
            Ok(None) => {
                self.file.seek(SeekFrom::Start(self.next))?;
                return Ok(ContainerStep::Other);
            }
            Ok(Some(prefix)) => self.record(prefix, &mut chunk, is_wanted, data),
            Err(fault) => Err(fault),
        };
        // Also after a fault: it lies in the chunk.
        self.chunk = Some(chunk);
        step
    }

    /// Reads a record of the file itself; chunks are opened, indices and attachments skipped.
    fn file_record(
        &mut self,
        is_wanted: &dyn Fn(&TopicChannel) -> bool,
        data: &mut Vec<u8>,
    ) -> Result<ContainerStep, McapFault> {
        let end = || McapFault::Io(ErrorKind::UnexpectedEof.into());
        let prefix = RecordPrefix::read(&mut self.file)?.ok_or_else(end)?;
        let start = self.file.stream_position()?;
        self.next = start.saturating_add(prefix.length);
        match prefix.opcode {
            op::DATA_END | op::FOOTER => return Ok(ContainerStep::End),
            op::CHUNK => {
                let mut file = self.file.get_ref().try_clone()?;
                file.seek(SeekFrom::Start(start))?;
                let bytes =
                    BufReader::with_capacity(buffer_size(prefix.length), file).take(prefix.length);
                self.chunk = match chunk::records(bytes, prefix.length) {
                    // Writers state the lengths of a chunk once it is whole.
                    Err(_) if self.next > self.length => return Err(end()),
                    records => Some(records?),
                };
                return Ok(ContainerStep::Other);
            }
            op::SCHEMA | op::CHANNEL | op::MESSAGE => {}
            _ if self.next > self.length => return Err(end()),
            _ => {
                self.file.seek(SeekFrom::Start(self.next))?;
                return Ok(ContainerStep::Other);
            }
        }
        let mut from = self.file.get_ref().try_clone()?;
        from.seek(SeekFrom::Start(start))?;
        let step = self.record(prefix, &mut from, is_wanted, data)?;
        self.file.seek(SeekFrom::Start(self.next))?;
        Ok(step)
    }

    /// Reads the content of a schema, a channel or a message; skips others.
    fn record(
        &mut self,
        prefix: RecordPrefix,
        from: &mut dyn Read,
        is_wanted: &dyn Fn(&TopicChannel) -> bool,
        data: &mut Vec<u8>,
    ) -> Result<ContainerStep, McapFault> {
        let RecordPrefix { opcode, length } = prefix;
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            skip_bytes(from, length)?;
            return Ok(ContainerStep::Other);
        }
        if length > MAX_RECORD as u64 {
            let why = format!("{length} bytes, which exceeds limit of {MAX_RECORD}");
            return Err(McapFault::field(prefix.field("length"), why));
        }
        let header = match opcode {
            op::MESSAGE => length.min(MESSAGE_HEADER),
            _ => length,
        };
        let mut buffer = std::mem::take(&mut self.buffer);
        read_bytes(from, header, &mut buffer)?;
        let parsed = McapRecord::parse(opcode, &buffer);
        let record =
            parsed.map_err(|part| McapFault::field(prefix.field(part), "cut short, or no text"))?;
        let head = record.and_then(|record| self.take_record(record));
        self.buffer = buffer;
        match head.filter(|head| is_wanted(&head.channel)) {
            Some(head) => {
                read_bytes(from, length - header, data)?;
                Ok(ContainerStep::Message(head))
            }
            None => {
                skip_bytes(from, length - header)?;
                Ok(ContainerStep::Other)
            }
        }
    }

    /// Keeps schemas and channels; the head of a message whose channel is known.
    fn take_record(&mut self, record: McapRecord<'_>) -> Option<MessageHead> {
        match record {
            McapRecord::Schema { id, name } => {
                self.schemas.insert(id, name.to_owned());
                None
            }
            McapRecord::Channel {
                id,
                schema,
                topic,
                encoding,
            } => {
                let schema = self.schemas.get(&schema).map_or("", String::as_str);
                let channel = TopicChannel::new(topic, schema, encoding);
                self.channels.insert(id, Arc::new(channel));
                None
            }
            McapRecord::Message {
                channel,
                sequence,
                log_time,
            } => {
                self.messages += 1;
                Some(MessageHead {
                    channel: self.channels.get(&channel)?.clone(),
                    sequence,
                    log_time_ns: log_time,
                    number: self.messages,
                })
            }
        }
    }

    /// Ends the stream: silently where the file does after its first message, else with an error.
    fn end(&mut self, fault: McapFault) -> Result<(), FormatError> {
        self.is_ended = true;
        let is_past_the_end = self.chunk.is_none() || self.next > self.length;
        let (field, why) = match fault {
            McapFault::Field(field, why) => (field, why),
            McapFault::Io(e) if e.kind() != ErrorKind::UnexpectedEof => {
                ("chunk".into(), format!("damaged ({e})"))
            }
            McapFault::Io(_) if !is_past_the_end => {
                let why = "damaged: fewer bytes than it states";
                ("chunk".into(), why.into())
            }
            McapFault::Io(_) if self.messages > 0 => {
                self.is_cut_short = true;
                return Ok(());
            }
            McapFault::Io(_) => ("record".into(), "the file is cut short".into()),
        };
        let field = format!("after message {}, {field}", self.messages);
        Err(FormatError::field(&self.path, field, why))
    }
}

impl MessageContainer for McapMessages {
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
