//! Records of an MCAP file that lead to messages, <https://mcap.dev/spec>.
//!
//! Read here rather than by the `mcap` crate: its parser allocates the length that a string states before it looks
//! whether the record has that many bytes, its reader the length of a record in a chunk, and a record that leads out of
//! its chunk overflows a subtraction.

use mcap::records::op;

/// Bytes of a message's record before its data.
pub(super) const MESSAGE_HEADER: u64 = 22;

/// Record on the way to a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum McapRecord<'a> {
    /// Schema and its name.
    Schema { id: u16, name: &'a str },
    /// Channel, its schema, topic and message encoding.
    Channel {
        id: u16,
        schema: u16,
        topic: &'a str,
        encoding: &'a str,
    },
    /// Header of a channel's message; data follow.
    Message {
        channel: u16,
        sequence: u32,
        /// Nanoseconds.
        log_time: u64,
    },
}

impl<'a> McapRecord<'a> {
    /// Parses the content of a record; `None` for the kinds that matter to no message.
    ///
    /// # Errors
    /// The field that is cut short, or no UTF-8.
    pub(super) fn parse(opcode: u8, content: &'a [u8]) -> Result<Option<Self>, &'static str> {
        let mut rest = content;
        Ok(Some(match opcode {
            op::SCHEMA => {
                let id = u16::from_le_bytes(take(&mut rest).ok_or("id")?);
                let name = text(&mut rest).ok_or("name")?;
                Self::Schema { id, name }
            }
            op::CHANNEL => Self::Channel {
                id: u16::from_le_bytes(take(&mut rest).ok_or("id")?),
                schema: u16::from_le_bytes(take(&mut rest).ok_or("schema_id")?),
                topic: text(&mut rest).ok_or("topic")?,
                encoding: text(&mut rest).ok_or("message_encoding")?,
            },
            op::MESSAGE => Self::Message {
                channel: u16::from_le_bytes(take(&mut rest).ok_or("channel_id")?),
                sequence: u32::from_le_bytes(take(&mut rest).ok_or("sequence")?),
                log_time: u64::from_le_bytes(take(&mut rest).ok_or("log_time")?),
            },
            _ => return Ok(None),
        }))
    }
}

/// Takes `N` bytes off the front.
pub(super) fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (head, tail) = rest.split_first_chunk()?;
    *rest = tail;
    Some(*head)
}

/// Takes a text with its length off the front.
pub(super) fn text<'a>(rest: &mut &'a [u8]) -> Option<&'a str> {
    let length = u32::from_le_bytes(take(rest)?);
    let (head, tail) = rest.split_at_checked(length as usize)?;
    *rest = tail;
    std::str::from_utf8(head).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_beyond_the_record_are_refused() {
        let schema = |length: u32| {
            let mut content = vec![7, 0];
            content.extend(length.to_le_bytes());
            content.extend(b"abc");
            content
        };
        let (fine, long) = (schema(3), schema(u32::MAX));
        let named = McapRecord::Schema { id: 7, name: "abc" };
        assert_eq!(McapRecord::parse(op::SCHEMA, &fine), Ok(Some(named)));
        assert_eq!(McapRecord::parse(op::SCHEMA, &long), Err("name"));
        assert_eq!(McapRecord::parse(op::ATTACHMENT, &[]), Ok(None));
        assert_eq!(McapRecord::parse(op::MESSAGE, &[0; 7]), Err("log_time"));
    }
}
