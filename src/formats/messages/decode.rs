//! Content of messages by schema and encoding: images, cameras, transforms, depth units.

use super::fault::MessageFault;
use super::foxglove_messages::{self, FoxgloveKind};
use super::message_item::MessageItem;
use super::realsense;
use super::ros_messages::{self, RosKind};
use super::wire_reader::RosWire;

/// Schema and encoding of messages that have a part in RGBD frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MessageKind {
    /// Protobuf schemas of Foxglove.
    Foxglove(FoxgloveKind),
    /// Messages of ROS 1 or ROS 2.
    Ros(RosWire, RosKind),
}

impl MessageKind {
    /// Kind by names; `None` for all others.
    pub(super) fn of(topic: &str, schema: &str, encoding: &str) -> Option<Self> {
        let wire = match encoding {
            "protobuf" => return FoxgloveKind::of(schema).map(Self::Foxglove),
            "cdr" => RosWire::Cdr,
            "ros1" => RosWire::Ros1,
            _ => return None,
        };
        let kind = RosKind::of(schema)?;
        kind.has_part(topic).then_some(Self::Ros(wire, kind))
    }
    /// True for images, raw or compressed.
    pub(super) fn is_image(self) -> bool {
        match self {
            Self::Foxglove(kind) => kind.is_image(),
            Self::Ros(_, kind) => kind.is_image(),
        }
    }
}

/// Decodes a message of a topic. Pixels stay encoded.
///
/// # Errors
/// A field that is cut short or no text.
pub(super) fn decode_message<'a>(
    kind: MessageKind,
    topic: &str,
    data: &'a [u8],
) -> Result<MessageItem<'a>, MessageFault> {
    let item = match kind {
        MessageKind::Foxglove(kind) => foxglove_messages::decode(kind, data)?,
        MessageKind::Ros(wire, kind) => ros_messages::decode(wire, kind, data)?,
    };
    Ok(realsense::with_stream_frames(topic, item))
}
