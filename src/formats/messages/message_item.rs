//! Decoded content of a message.

use super::camera_info::CameraInfo;
use super::image_message::ImageMessage;
use super::transforms::FrameEdge;

/// Content of a message.
#[derive(Clone, Debug)]
pub(super) enum MessageItem<'a> {
    Image(ImageMessage<'a>),
    Camera(CameraInfo),
    Transforms(Vec<FrameEdge>),
    /// Metres of a unit of 16-bit depth.
    DepthUnit(f64),
}
