//! Cameras of ROS 2 over zenoh, without ROS: `ros2:/camera/depth/image_rect_raw,/camera/color/image_raw`.
//!
//! `topics` are configured, `keys` name them on zenoh, `network` connects, `opening` waits for the cameras' calibration,
//! `subscription` fills the `inbox` while somebody reads, `presence` shows it to ROS, and `source` makes frames of it
//! (`tryon_formats::live`).

mod inbox;
mod keys;
mod network;
mod opening;
mod presence;
mod source;
mod subscription;
mod topics;

pub(crate) use opening::open;
pub(crate) use topics::Topics;
