//! Cameras of ROS 2: messages that `rosbags` serialised, on a network of zenoh's Python client (`publisher.py`).

mod cameras;
#[path = "../common/mod.rs"]
mod common;
mod consent;
mod pictures;
mod streams;
