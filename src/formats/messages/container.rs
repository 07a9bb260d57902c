//! Interface of every file of recorded messages: channels, and messages in file order.

use super::decode::{MessageKind, decode_message};
use super::fault::MessageFault;
use super::message_item::MessageItem;
use crate::FormatError;
use std::path::Path;
use std::sync::Arc;

/// Largest message or record, bytes: an uncompressed colour image of 4096 × 4096 has 48 MiB.
pub(crate) const MAX_RECORD: usize = 64 << 20;

/// Publisher of a topic, in one encoding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct TopicChannel {
    /// Name of the topic.
    pub(crate) topic: String,
    /// Name of the schema, as the file writes it.
    pub(crate) schema: String,
    /// Encoding of its messages: `protobuf`, `cdr`, `ros1` or another.
    pub(crate) encoding: String,
    /// Content of its messages; `None` for those that have no part in RGBD frames.
    pub(super) kind: Option<MessageKind>,
}

impl TopicChannel {
    /// TopicChannel of a topic.
    pub(crate) fn new(topic: &str, schema: &str, encoding: &str) -> Self {
        Self {
            topic: topic.to_owned(),
            schema: schema.to_owned(),
            encoding: encoding.to_owned(),
            kind: MessageKind::of(topic, schema, encoding),
        }
    }
    /// True for images, raw or compressed.
    pub(super) fn has_images(&self) -> bool {
        self.kind.is_some_and(MessageKind::is_image)
    }
    /// Decodes a message; `None` for kinds of no interest. Pixels stay encoded.
    ///
    /// # Errors
    /// A field that is cut short or no text.
    pub(super) fn decode<'a>(
        &self,
        data: &'a [u8],
    ) -> Result<Option<MessageItem<'a>>, MessageFault> {
        let kind = self
            .kind
            .map(|kind| decode_message(kind, &self.topic, data));
        kind.transpose()
    }
}

/// Place of a message in its file.
#[derive(Clone, Debug)]
pub(crate) struct MessageHead {
    /// Its channel.
    pub(crate) channel: Arc<TopicChannel>,
    /// Sequence number of the channel; 0 where the container has none.
    pub(crate) sequence: u32,
    /// Time of recording, nanoseconds.
    pub(crate) log_time_ns: u64,
    /// Number of the message in the file, from one.
    pub(crate) number: u64,
}

impl MessageHead {
    /// Error of this message: adds file, topic, schema and number to a fault.
    pub(super) fn error(&self, path: &Path, fault: MessageFault) -> FormatError {
        let (number, channel) = (self.number, &self.channel);
        let field = format!(
            "message {number}, {} ({}).{}",
            channel.topic, channel.schema, fault.field
        );
        FormatError::field(path, field, fault.why)
    }
}

/// Step of reading a file of messages.
pub(crate) enum ContainerStep {
    /// Message of a wanted channel; its bytes are read.
    Message(MessageHead),
    /// Another record, an unwanted message, or the end of a chunk.
    Other,
    /// End of the messages, from then on.
    End,
}

/// File of recorded messages, read from start to end with memory for one message.
pub(crate) trait MessageContainer: Send {
    /// Reads a record. The bytes of a message whose channel is wanted replace `data`. A truncated file ends.
    ///
    /// # Errors
    /// A damaged record. The container is then at its end.
    fn step(
        &mut self,
        is_wanted: &dyn Fn(&TopicChannel) -> bool,
        data: &mut Vec<u8>,
    ) -> Result<ContainerStep, FormatError>;
    /// The next message whose channel is wanted; `None` at the end.
    ///
    /// # Errors
    /// As [`Self::step`].
    fn next_message(
        &mut self,
        is_wanted: &dyn Fn(&TopicChannel) -> bool,
        data: &mut Vec<u8>,
    ) -> Result<Option<MessageHead>, FormatError> {
        loop {
            match self.step(is_wanted, data)? {
                ContainerStep::Message(head) => return Ok(Some(head)),
                ContainerStep::Other => {}
                ContainerStep::End => return Ok(None),
            }
        }
    }
    /// Channels met so far.
    fn channels(&self) -> Vec<Arc<TopicChannel>>;
    /// True if the end that was reached lies within a record.
    fn is_cut_short(&self) -> bool;
}
