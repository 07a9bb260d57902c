//! Images of one topic, in file order, by time.

use super::container::{MessageContainer, MessageHead, TopicChannel};
use super::image_message::ImageMessage;
use super::message_item::MessageItem;
use crate::FormatError;
use std::path::{Path, PathBuf};

/// Clock of a recording's images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TimeBase {
    /// Capture times in the images' headers.
    Stamp,
    /// Times of recording.
    Log,
}

/// Image and its place in the file; pixels stay encoded.
#[derive(Debug)]
pub(super) struct TimedImage {
    pub(super) time_ns: u64,
    pub(super) head: MessageHead,
    pub(super) image: ImageMessage<'static>,
}

impl TimedImage {
    /// Decodes a message all but its pixels; `None` for one that is no image.
    ///
    /// # Errors
    /// A field that is cut short or no text.
    pub(super) fn decode(
        head: MessageHead,
        data: &[u8],
        times: TimeBase,
        origin: &Path,
    ) -> Result<Option<Self>, FormatError> {
        let decoded = head.channel.decode(data);
        let item = decoded.map_err(|fault| head.error(origin, fault))?;
        let Some(MessageItem::Image(image)) = item else {
            return Ok(None);
        };
        let time_ns = match times {
            TimeBase::Stamp => image.stamp_ns.unwrap_or(head.log_time_ns),
            TimeBase::Log => head.log_time_ns,
        };
        Ok(Some(Self {
            time_ns,
            head,
            image: image.into_owned(),
        }))
    }
}

/// Reader of one topic's images, with memory for one.
pub(super) struct TopicImages {
    path: PathBuf,
    container: Box<dyn MessageContainer>,
    topic: String,
    times: TimeBase,
    buffer: Vec<u8>,
    is_ended: bool,
}

impl TopicImages {
    pub(super) fn new(
        path: PathBuf,
        container: Box<dyn MessageContainer>,
        topic: &str,
        times: TimeBase,
    ) -> Self {
        Self {
            path,
            container,
            topic: topic.to_owned(),
            times,
            buffer: Vec::new(),
            is_ended: false,
        }
    }

    /// The container, for what it knows at its end.
    pub(super) fn container(&self) -> &dyn MessageContainer {
        &*self.container
    }
    /// True after the last image, and after damage that ends the file.
    pub(super) fn is_ended(&self) -> bool {
        self.is_ended
    }

    /// The next image; `None` at the end.
    ///
    /// # Errors
    /// A message at fault, after which the next one follows, or a damaged file, which has no next one.
    pub(super) fn next_image(&mut self) -> Result<Option<TimedImage>, FormatError> {
        while !self.is_ended {
            let topic = &self.topic;
            let is_wanted = |c: &TopicChannel| c.topic == *topic && c.has_images();
            let read = self.container.next_message(&is_wanted, &mut self.buffer);
            self.is_ended = !matches!(read, Ok(Some(_)));
            let Some(head) = read? else { break };
            let image = TimedImage::decode(head, &self.buffer, self.times, &self.path)?;
            if image.is_some() {
                return Ok(image);
            }
        }
        Ok(None)
    }
}
