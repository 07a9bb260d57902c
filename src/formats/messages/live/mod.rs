//! Frames of a live ROS 2 camera, from messages as they arrive: CDR, whatever the bus.
//!
//! [`LiveCamera`] gathers cameras and transforms, which show nobody. [`LiveFrames`] decodes images and pairs them.

mod camera;
mod frames;
mod period;
mod topics;

#[cfg(test)]
mod tests;

pub use camera::LiveCamera;
pub use frames::{LiveDecoder, LiveFrames, LiveImage, LiveMessage, UnpairedDepth};
pub use topics::{camera_info_topic, is_ros_image_type, ros_type_by_name};

/// Colour images that may wait for their depth. Depth that is later than this many colour images goes without colour.
pub const LIVE_COLOR_IMAGES: usize = 8;
