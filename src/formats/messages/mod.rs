//! Messages of recorded topics, whatever their container, and the RGBD frames they make.
//!
//! container → decode → survey → selection → calibration → pairing: each stage is a file here. A container (MCAP, ROS
//! bag, rosbag2) only yields messages in file order; every stage after it is common to all.

mod calibration;
mod camera_info;
mod compressed;
mod container;
mod decode;
mod fault;
mod foxglove_messages;
mod frame_decoder;
mod image_layout;
mod image_message;
pub mod live;
mod message_item;
mod pairing;
mod raw_pixels;
mod realsense;
mod ros_messages;
mod selection;
mod source;
mod survey;
mod topic_images;
mod transforms;
mod wire_reader;

#[cfg(test)]
mod librealsense_tests;
#[cfg(test)]
mod recorded_tests;
#[cfg(test)]
mod report_tests;

pub(crate) use container::{
    ContainerStep, MAX_RECORD, MessageContainer, MessageHead, TopicChannel,
};
pub(crate) use source::{MessageSource, OpenContainer, StreamOptions};
