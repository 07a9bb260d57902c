//! Frames of a ROS 2 camera as a source.

use super::inbox::{Inbox, Message};
use super::subscription::Subscription;
use super::topics::Topics;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tryon_formats::live::{LiveDecoder, LiveFrames, LiveImage, LiveMessage};
use tryon_formats::{FormatError, RgbdSource};
use tryon_geometry::camera::{Calibration, LensCalibration, RgbdFrame};

/// Depth images without colour in a row after which this is said: half a second.
const SAID_AFTER: u64 = 15;

/// Images of one camera, newest first. It never ends; without images it waits.
pub(super) struct Ros2Source {
    /// For errors.
    pub(super) name: PathBuf,
    pub(super) topics: Topics,
    pub(super) session: zenoh::Session,
    pub(super) subscription: Arc<Subscription>,
    pub(super) inbox: Arc<Inbox>,
    pub(super) frames: LiveFrames,
    pub(super) said: Said,
}

/// Remarks that are made once.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Said {
    unpaired: bool,
    unstamped: bool,
}

/// Decodes all of a message but its pixels.
fn image(decoder: &LiveDecoder, topic: &str, message: &Message) -> Result<LiveImage, FormatError> {
    decoder.image(LiveMessage {
        topic,
        schema: message.schema.as_deref(),
        data: &message.payload.to_bytes(),
        arrived_ns: message.arrived_ns,
        number: message.number,
    })
}

impl Ros2Source {
    fn read(&mut self) -> Result<RgbdFrame, FormatError> {
        let message = self.inbox.depth();
        let depth = image(self.frames.decoder(), &self.topics.depth, &message)?;
        self.say_unstamped(&depth);
        let (inbox, color) = (&self.inbox, self.topics.color.as_deref());
        let next = |decoder: &LiveDecoder, wait: Duration| {
            let color = color.zip(inbox.color(message.arrived + wait));
            color
                .map(|(topic, m)| image(decoder, topic, &m))
                .transpose()
        };
        let before = self.frames.unpaired().total;
        let frame = self.frames.frame(depth, next);
        self.count_unpaired(before);
        frame
    }

    fn say_unstamped(&mut self, depth: &LiveImage) {
        if !depth.has_stamp() && !std::mem::replace(&mut self.said.unstamped, true) {
            let why = "no capture times (header.stamp); times of arrival are taken";
            tracing::warn!(source = %self.name.display(), topic = self.topics.depth, "{why}");
        }
    }

    /// Counts depth without colour, and says once that the two do not belong together.
    fn count_unpaired(&mut self, before: u64) {
        let unpaired = self.frames.unpaired();
        metrics::counter!("tryon_capture_ros2_unpaired").increment(unpaired.total - before);
        let is_said = unpaired.in_a_row < SAID_AFTER;
        if is_said || std::mem::replace(&mut self.said.unpaired, true) {
            return;
        }
        let why = match unpaired.offset_ns {
            None => "depth goes without colour: none arrives".to_owned(),
            Some(offset) => format!(
                "depth goes without colour: their stamps do not come within half a frame, the nearest colour's is {:+.1} ms \
                 from depth's",
                offset as f64 * 1e-6
            ),
        };
        tracing::warn!(source = %self.name.display(), dropped = self.inbox.dropped(), "{why}");
    }
}

impl RgbdSource for Ros2Source {
    fn calibration(&self) -> &Calibration {
        self.frames.calibration()
    }
    fn lenses(&self) -> LensCalibration {
        self.frames.lenses()
    }
    fn len(&self) -> Option<usize> {
        None
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        self.inbox.begin();
        let subscribed = self.subscription.begin(&self.session);
        let subscribed =
            subscribed.map_err(|e| FormatError::field(&self.name, "subscription", e.to_string()));
        let frame = subscribed.and_then(|()| self.read());
        self.inbox.end();
        frame.map(Some)
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        Ok(())
    }
}
