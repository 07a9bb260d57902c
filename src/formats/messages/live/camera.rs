//! Cameras and transforms of a live camera, until frames can be decoded.

use super::frames::LiveFrames;
use super::topics::{camera_info_topic, ros_type_by_name};
use crate::FormatError;
use crate::messages::container::{MessageHead, TopicChannel};
use crate::messages::fault::MessageFault;
use crate::messages::frame_decoder::FrameDecoder;
use crate::messages::image_layout::PixelContent;
use crate::messages::message_item::MessageItem;
use crate::messages::selection::Selection;
use crate::messages::survey::{CameraTopic, ImageTopic, Survey};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Camera of a depth topic and, if wished, of a colour topic.
pub struct LiveCamera {
    /// Named in errors.
    name: PathBuf,
    depth: String,
    color: Option<String>,
    survey: Survey,
    messages: u64,
}

impl LiveCamera {
    /// Camera of the images of `depth` and `color`, about which nothing is known yet.
    pub fn new(name: &Path, depth: &str, color: Option<&str>) -> Self {
        Self {
            name: name.to_owned(),
            depth: depth.to_owned(),
            color: color.map(str::to_owned),
            survey: Survey::default(),
            messages: 0,
        }
    }

    fn images(&self) -> impl Iterator<Item = &str> {
        [Some(self.depth.as_str()), self.color.as_deref()]
            .into_iter()
            .flatten()
    }

    /// Topics of the cameras, by ROS's convention.
    pub fn info_topics(&self) -> Vec<String> {
        let mut topics: Vec<String> = self.images().map(camera_info_topic).collect();
        topics.dedup();
        topics
    }

    /// Topics of cameras that have stated none yet.
    pub fn missing(&self) -> Vec<String> {
        let mut topics = self.info_topics();
        topics.retain(|t| self.camera(t).is_none());
        topics
    }

    /// Camera that a topic has stated.
    fn camera(&self, topic: &str) -> Option<&CameraTopic> {
        self.survey.cameras.values().find(|c| c.topic == topic)
    }

    /// Takes a message of a camera or of transforms; `schema` is `None` where the bus states no type. Images are not even
    /// decoded.
    ///
    /// # Errors
    /// Names the topic, and the field that is cut short, or the type that is none of these.
    pub fn insert(
        &mut self,
        topic: &str,
        schema: Option<&str>,
        data: &[u8],
    ) -> Result<(), FormatError> {
        self.messages += 1;
        let schema = schema.unwrap_or_else(|| ros_type_by_name(topic));
        let channel = Arc::new(TopicChannel::new(topic, schema, "cdr"));
        let head = MessageHead {
            channel,
            sequence: 0,
            log_time_ns: 0,
            number: self.messages,
        };
        let fault = |f: MessageFault| head.error(&self.name, f);
        let item = match head.channel.has_images() {
            true => None,
            false => head.channel.decode(data).map_err(fault)?,
        };
        match item {
            Some(item @ (MessageItem::Camera(_) | MessageItem::Transforms(_))) => {
                self.survey.insert(&head, item);
                Ok(())
            }
            _ => {
                let why = "expected sensor_msgs/CameraInfo or tf2_msgs/TFMessage";
                Err(fault(MessageFault::new("type", why)))
            }
        }
    }

    /// True while a transform from depth to colour is missing: their frames of reference differ and nothing relates them.
    pub fn lacks_transform(&self) -> bool {
        let mut frames = self.images().map(camera_info_topic);
        let mut frame = || {
            let camera = self.camera(&frames.next()?)?;
            Some(camera.info.frame_id.as_str())
        };
        match (frame(), frame()) {
            (Some(depth), Some(color)) => self.survey.frames.transform(depth, color).is_none(),
            _ => false,
        }
    }

    /// Decoder and pairing of the images.
    ///
    /// # Errors
    /// A camera that is missing, or that cannot be used.
    pub fn frames(&self) -> Result<LiveFrames, FormatError> {
        let named = |f: MessageFault| FormatError::field(&self.name, f.field, f.why);
        let depth = self
            .image(&self.depth, PixelContent::Depth)
            .map_err(named)?;
        let color = self.color.as_deref();
        let color = color.map(|topic| self.image(topic, PixelContent::Color).map_err(named));
        let color = color.transpose()?;
        let selection = Selection {
            depth: &depth,
            color: color.as_ref(),
            notes: Vec::new(),
        };
        let found = self.survey.calibrate(&selection).map_err(named)?;
        let decoder = FrameDecoder::new(&self.name, found.lenses, found.depth_unit);
        Ok(LiveFrames::new(decoder, self.color.is_some(), found.notes))
    }

    /// Image topic as its camera describes it: no image has been read.
    fn image(&self, topic: &str, content: PixelContent) -> Result<ImageTopic, MessageFault> {
        let info = camera_info_topic(topic);
        let Some(camera) = self.camera(&info) else {
            return Err(MessageFault::new(info, "no camera has arrived"));
        };
        Ok(ImageTopic {
            topic: topic.to_owned(),
            schema: ros_type_by_name(topic).to_owned(),
            content,
            encoding: String::new(),
            frame_id: camera.info.frame_id.clone(),
            size: None,
            depth_unit: None,
            has_stamps: true,
            images: 0,
        })
    }
}
