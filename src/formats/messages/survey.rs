//! Topics, cameras and transforms of a recording's start.

use super::camera_info::CameraInfo;
use super::container::{MessageContainer, MessageHead, TopicChannel};
use super::image_layout::PixelContent;
use super::image_message::ImageMessage;
use super::message_item::MessageItem;
use super::transforms::FrameGraph;
use crate::FormatError;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Images of one topic searched: writers repeat calibrations at least once a second.
const LOOK_AHEAD: u64 = 60;

/// An image topic, by its first image.
#[derive(Clone, Debug)]
pub(super) struct ImageTopic {
    pub(super) topic: String,
    pub(super) schema: String,
    pub(super) content: PixelContent,
    /// Encoding or format, as written.
    pub(super) encoding: String,
    pub(super) frame_id: String,
    /// Width and height; `None` for image files.
    pub(super) size: Option<(u32, u32)>,
    /// Metres of a unit of 16-bit depth, if the image states it.
    pub(super) depth_unit: Option<f64>,
    /// True if every image met states its capture time.
    pub(super) has_stamps: bool,
    /// Images met.
    pub(super) images: u64,
}

impl std::fmt::Display for ImageTopic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let encoding = if self.encoding.is_empty() {
            "no encoding"
        } else {
            &self.encoding
        };
        write!(f, "`{}` ({encoding}", self.topic)?;
        if let Some((width, height)) = self.size {
            write!(f, " {width}×{height}")?;
        }
        write!(f, ")")
    }
}

/// A camera and the topic that states it.
#[derive(Clone, Debug)]
pub(super) struct CameraTopic {
    pub(super) topic: String,
    pub(super) schema: String,
    pub(super) info: CameraInfo,
    /// True if later messages state another camera for the frame.
    pub(super) changes: bool,
}

/// Content of a recording's start.
#[derive(Debug, Default)]
pub(super) struct Survey {
    /// Image topics by name.
    pub(super) images: BTreeMap<String, ImageTopic>,
    /// Cameras by topic and frame of reference.
    pub(super) cameras: BTreeMap<(String, String), CameraTopic>,
    pub(super) frames: FrameGraph,
    /// Option topics of depth units, and the unit \[m\].
    pub(super) depth_units: Vec<(String, f64)>,
    /// Channels met.
    pub(super) channels: Vec<Arc<TopicChannel>>,
    /// First message at fault.
    pub(super) fault: Option<FormatError>,
}

impl Survey {
    /// Reads until a topic has shown [`LOOK_AHEAD`] images, or to the end. Damage ends it, once there are images.
    ///
    /// # Errors
    /// A damaged start.
    pub(super) fn read(
        path: &Path,
        container: &mut dyn MessageContainer,
    ) -> Result<Self, FormatError> {
        let (mut survey, mut data) = (Self::default(), Vec::new());
        loop {
            let head = match container.next_message(&|c| c.kind.is_some(), &mut data) {
                Ok(Some(head)) => head,
                Ok(None) => break,
                Err(_) if !survey.images.is_empty() => break,
                Err(e) => return Err(e),
            };
            match head.channel.decode(&data) {
                Ok(Some(item)) => survey.insert(&head, item),
                Ok(None) => {}
                Err(fault) => {
                    survey.fault.get_or_insert_with(|| head.error(path, fault));
                }
            }
            if survey.images.values().any(|t| t.images >= LOOK_AHEAD) {
                break;
            }
        }
        survey.channels = container.channels();
        Ok(survey)
    }

    /// Adds the content of a message.
    pub(super) fn insert(&mut self, head: &MessageHead, item: MessageItem<'_>) {
        match item {
            MessageItem::Image(image) => self.insert_image(head, &image),
            MessageItem::Camera(info) => self.insert_camera(head, info),
            MessageItem::Transforms(edges) => {
                edges.into_iter().for_each(|e| self.frames.insert(e));
            }
            MessageItem::DepthUnit(unit) => {
                self.depth_units.push((head.channel.topic.clone(), unit));
            }
        }
    }

    fn insert_image(&mut self, head: &MessageHead, image: &ImageMessage<'_>) {
        let channel = &head.channel;
        let entry = self.images.entry(channel.topic.clone());
        let topic = entry.or_insert_with(|| ImageTopic {
            topic: channel.topic.clone(),
            schema: channel.schema.clone(),
            content: image.content(),
            encoding: image.encoding().to_owned(),
            frame_id: image.frame_id.clone(),
            size: image.size(),
            depth_unit: image.depth_unit.filter(|u| *u != 0.0),
            has_stamps: true,
            images: 0,
        });
        topic.images += 1;
        topic.has_stamps &= image.stamp_ns.is_some();
    }

    fn insert_camera(&mut self, head: &MessageHead, info: CameraInfo) {
        let channel = &head.channel;
        let key = (channel.topic.clone(), info.frame_id.clone());
        let known = self.cameras.entry(key).or_insert_with(|| CameraTopic {
            topic: channel.topic.clone(),
            schema: channel.schema.clone(),
            info: info.clone(),
            changes: false,
        });
        known.changes |= known.info != info;
    }
}
