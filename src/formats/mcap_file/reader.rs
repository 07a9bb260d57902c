//! Messages of an MCAP file as a stream.

use super::record::McapRecord;
use crate::FormatError;
use crate::messages::{MAX_RECORD, MessageContainer, MessageHead, TopicChannel};
use mcap::McapError;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes read at a time.
const BUFFER: usize = 1 << 16;

/// MCAP file, read record by record.
pub(crate) struct McapMessages {
    path: PathBuf,
    file: File,
    records: LinearReader,
    /// Names of schemas by number.
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Arc<TopicChannel>>,
    messages: u64,
    is_ended: bool,
    is_cut_short: bool,
}

impl McapMessages {
    /// Opens a file at its start.
    ///
    /// # Errors
    /// Those of the system.
    pub(crate) fn open(path: &Path) -> Result<Box<dyn MessageContainer>, FormatError> {
        let file = File::open(path).map_err(|e| FormatError::io(path, e))?;
        // A greater length is refused before anything is allocated.
        let options = LinearReaderOptions::default()
            .with_record_length_limit(MAX_RECORD)
            .with_validate_chunk_crcs(true);
        Ok(Box::new(Self {
            path: path.to_owned(),
            file,
            records: LinearReader::new_with_options(options),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            messages: 0,
            is_ended: false,
            is_cut_short: false,
        }))
    }

    /// Ends the stream: silently where the file does after its first message, else with an error.
    fn end(&mut self, error: McapError) -> Result<(), FormatError> {
        self.is_ended = true;
        let is_cut = matches!(error, McapError::UnexpectedEof | McapError::UnexpectedEoc);
        if is_cut && self.messages > 0 {
            self.is_cut_short = true;
            return Ok(());
        }
        let field = format!("after message {}", self.messages);
        Err(FormatError::field(&self.path, field, error.to_string()))
    }

    fn add_channel(&mut self, id: u16, schema: u16, topic: &str, encoding: &str) {
        let schema = self.schemas.get(&schema).map_or("", String::as_str);
        let channel = TopicChannel::new(topic, schema, encoding);
        // The summary repeats channels.
        if self.channels.get(&id).is_none_or(|c| **c != channel) {
            self.channels.insert(id, Arc::new(channel));
        }
    }
}

impl MessageContainer for McapMessages {
    fn next_message(
        &mut self,
        is_wanted: &dyn Fn(&TopicChannel) -> bool,
        data: &mut Vec<u8>,
    ) -> Result<Option<MessageHead>, FormatError> {
        while !self.is_ended {
            let (opcode, content) = match self.records.next_event() {
                None => break,
                Some(Ok(LinearReadEvent::ReadRequest(n))) => {
                    // At most a buffer at a time: a wrong length costs no more memory than the file holds.
                    let want = self.records.insert(n.min(BUFFER));
                    let got = self.file.read(want);
                    let got = got.map_err(|e| FormatError::io(&self.path, e))?;
                    self.records.notify_read(got);
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => (opcode, data),
                Some(Err(e)) => {
                    self.end(e)?;
                    break;
                }
            };
            let record = McapRecord::parse(opcode, content).map_err(|part| {
                let field = format!("record 0x{opcode:02x}.{part}");
                FormatError::field(&self.path, field, "cut short, or no text")
            });
            match record.inspect_err(|_| self.is_ended = true)? {
                Some(McapRecord::Schema { id, name }) => {
                    self.schemas.insert(id, name.to_owned());
                }
                Some(McapRecord::Channel {
                    id,
                    schema,
                    topic,
                    encoding,
                }) => {
                    let (topic, encoding) = (topic.to_owned(), encoding.to_owned());
                    self.add_channel(id, schema, &topic, &encoding);
                }
                Some(McapRecord::Message {
                    channel,
                    sequence,
                    log_time,
                    data: content,
                }) => {
                    self.messages += 1;
                    let channel = self.channels.get(&channel);
                    if let Some(channel) = channel.filter(|c| is_wanted(c)) {
                        data.clear();
                        data.extend_from_slice(content);
                        return Ok(Some(MessageHead {
                            channel: channel.clone(),
                            sequence,
                            log_time_ns: log_time,
                            number: self.messages,
                        }));
                    }
                }
                None => {}
            }
        }
        self.is_ended = true;
        Ok(None)
    }
    fn channels(&self) -> Vec<Arc<TopicChannel>> {
        self.channels.values().cloned().collect()
    }
    fn is_cut_short(&self) -> bool {
        self.is_cut_short
    }
}
