//! Continues a recording whose writer was stopped.

use super::reader::McapMessages;
use super::writer::McapWriter;
use crate::FormatError;
use std::path::Path;
use tryon_geometry::camera::Calibration;

/// Message of a frame that is not yet whole.
struct PendingMessage {
    channel: u16,
    sequence: u32,
    time_ns: u64,
    data: Vec<u8>,
}

impl McapWriter {
    /// Creates a file that begins with the first frames of `part`, at most `frames` of them: message by message, so that
    /// the whole file has the bytes that one writer gives it. [`McapWriter::frames`] is the count of whole ones.
    ///
    /// # Errors
    /// As [`McapWriter::create`], or a part that is no MCAP file. Damage ends the part.
    pub fn resume(
        path: &Path,
        part: &Path,
        calibration: &Calibration,
        frames: usize,
    ) -> Result<Self, FormatError> {
        let mut messages = McapMessages::open(part)?;
        let mut writer = Self::create(path, calibration)?;
        let (mut pending, mut data) = (Vec::new(), Vec::new());
        while writer.frames() < frames {
            let Ok(Some(head)) = messages.next_message(&|_| true, &mut data) else {
                break;
            };
            let Some(channel) = writer.channels.of(&head.channel.topic) else {
                break;
            };
            pending.push(PendingMessage {
                channel,
                sequence: head.sequence,
                time_ns: head.log_time_ns,
                data: data.clone(),
            });
            // Depth completes a frame.
            if channel == writer.channels.depth {
                for m in pending.drain(..) {
                    writer.put(m.channel, m.sequence, m.time_ns, &m.data)?;
                }
                writer.end_frame()?;
            }
        }
        Ok(writer)
    }
}
