//! Frames of depth images as they arrive, each with the colour image that pairs with it.

use super::LIVE_COLOR_IMAGES;
use super::period::FramePeriod;
use super::topics::ros_type_by_name;
use crate::FormatError;
use crate::messages::container::{MAX_RECORD, MessageHead, TopicChannel};
use crate::messages::fault::MessageFault;
use crate::messages::frame_decoder::FrameDecoder;
use crate::messages::pairing::NearestItem;
use crate::messages::topic_images::{TimeBase, TimedImage};
use std::sync::Arc;
use std::time::Duration;
use tryon_geometry::camera::{Calibration, ColorImage, LensCalibration, RgbdFrame};

/// A message as the bus delivers it.
#[derive(Clone, Copy, Debug)]
pub struct LiveMessage<'a> {
    /// Topic, for errors and for its type.
    pub topic: &'a str,
    /// Type, if the bus states it.
    pub schema: Option<&'a str>,
    /// CDR with its header.
    pub data: &'a [u8],
    /// Time of arrival, nanoseconds: that of images without a stamp.
    pub arrived_ns: u64,
    /// Number of the message, for errors.
    pub number: u64,
}

/// An image whose pixels are still encoded.
#[derive(Debug)]
pub struct LiveImage(TimedImage);

impl LiveImage {
    /// Capture time, or that of arrival without a stamp, nanoseconds.
    pub fn time_ns(&self) -> u64 {
        self.0.time_ns
    }
    /// True if the message states its capture time.
    pub fn has_stamp(&self) -> bool {
        self.0.image.stamp_ns.is_some()
    }
}

/// Decoder of messages to images.
pub struct LiveDecoder(FrameDecoder);

impl LiveDecoder {
    /// Decodes all of a message but its pixels.
    ///
    /// # Errors
    /// Names the message, and the field that is cut short, its size, or its type if it is no image.
    pub fn image(&self, message: LiveMessage<'_>) -> Result<LiveImage, FormatError> {
        let topic = message.topic;
        let schema = message.schema.unwrap_or_else(|| ros_type_by_name(topic));
        let head = MessageHead {
            channel: Arc::new(TopicChannel::new(topic, schema, "cdr")),
            sequence: 0,
            log_time_ns: message.arrived_ns,
            number: message.number,
        };
        let origin = self.0.origin().to_owned();
        let fault = |head: &MessageHead, field, why| {
            Err(head.error(&origin, MessageFault::new(field, why)))
        };
        if message.data.len() > MAX_RECORD {
            let why = format!(
                "{} bytes, expected at most {MAX_RECORD}",
                message.data.len()
            );
            return fault(&head, "data", why);
        }
        if !head.channel.has_images() {
            let why = "expected sensor_msgs/Image or sensor_msgs/CompressedImage";
            return fault(&head, "type", why.into());
        }
        let decoded = TimedImage::decode(head.clone(), message.data, TimeBase::Stamp, &origin)?;
        match decoded {
            Some(image) => Ok(LiveImage(image)),
            None => fault(&head, "type", "no image".into()),
        }
    }
}

/// Depth images that went without colour, of a camera with a colour topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UnpairedDepth {
    /// Since the last pair.
    pub in_a_row: u64,
    /// Since the beginning.
    pub total: u64,
    /// Time of the nearest colour less that of depth, nanoseconds; `None` where no colour has arrived.
    pub offset_ns: Option<i64>,
}

/// Frames of a camera whose calibration is known.
pub struct LiveFrames {
    decoder: LiveDecoder,
    has_color: bool,
    notes: Vec<String>,
    nearest: NearestItem<TimedImage>,
    period: FramePeriod,
    unpaired: UnpairedDepth,
    frames: u64,
}

impl LiveFrames {
    pub(super) fn new(decoder: FrameDecoder, has_color: bool, notes: Vec<String>) -> Self {
        Self {
            decoder: LiveDecoder(decoder),
            has_color,
            notes,
            nearest: NearestItem::new(),
            period: FramePeriod::default(),
            unpaired: UnpairedDepth::default(),
            frames: 0,
        }
    }

    /// Calibration of all frames.
    pub fn calibration(&self) -> &Calibration {
        self.decoder.0.calibration()
    }
    /// Calibration with the distortion that the frames have.
    pub fn lenses(&self) -> LensCalibration {
        self.decoder.0.lenses()
    }
    /// Fields of the cameras that are not applied, and what is assumed.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }
    /// Decoder of the images.
    pub fn decoder(&self) -> &LiveDecoder {
        &self.decoder
    }
    /// Depth images without colour.
    pub fn unpaired(&self) -> UnpairedDepth {
        self.unpaired
    }

    /// Frame of a depth image and of the colour nearest to it in time: within half a frame, lest it belong to another depth
    /// image, and within the limit of recordings. `next_color` returns colour images in the order of their arrival, and
    /// `None` where none comes within the time that it is told since the arrival of depth: half a period, or nothing once
    /// a colour image is near enough.
    ///
    /// # Errors
    /// Those of `next_color`, and those of pixels: they name the message and its field.
    pub fn frame(
        &mut self,
        depth: LiveImage,
        next_color: impl FnMut(&LiveDecoder, Duration) -> Result<Option<LiveImage>, FormatError>,
    ) -> Result<RgbdFrame, FormatError> {
        let LiveImage(depth) = depth;
        let color = self.color_at(depth.time_ns, next_color)?;
        let sequence = self.frames;
        self.frames += 1;
        Ok(RgbdFrame {
            sequence,
            time_ns: depth.time_ns,
            depth: self.decoder.0.depth(&depth)?,
            color,
        })
    }

    fn color_at(
        &mut self,
        at: u64,
        mut next_color: impl FnMut(&LiveDecoder, Duration) -> Result<Option<LiveImage>, FormatError>,
    ) -> Result<Option<ColorImage>, FormatError> {
        if !self.has_color {
            return Ok(None);
        }
        let period = self.period.update(at);
        let decoder = &self.decoder;
        let next = |gap: Option<u64>| {
            let wait = match gap {
                Some(gap) if gap <= period / 2 => Duration::ZERO,
                _ => Duration::from_nanos(period / 2),
            };
            let image = next_color(decoder, wait)?;
            Ok::<_, FormatError>(image.map(|LiveImage(i)| (i.time_ns, i)))
        };
        self.nearest
            .forget_beyond(at, LIVE_COLOR_IMAGES as u64 * period);
        let neighbours = [at.checked_sub(period), at.checked_add(period)];
        let paired = self.nearest.pair(at, neighbours, next)?;
        let color = paired.map(|image| decoder.0.color(image)).transpose()?;
        if color.is_some() {
            self.unpaired.in_a_row = 0;
            return Ok(color);
        }
        self.unpaired = UnpairedDepth {
            in_a_row: self.unpaired.in_a_row + 1,
            total: self.unpaired.total + 1,
            offset_ns: self.nearest.offset(at),
        };
        Ok(None)
    }
}

impl std::fmt::Debug for LiveFrames {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LiveFrames")
            .field("origin", &self.decoder.0.origin() as &dyn std::fmt::Debug)
            .finish_non_exhaustive()
    }
}
