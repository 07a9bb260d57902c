//! ROS 1 bags, format 2.0 (<http://wiki.ros.org/Bags/Format/2.0>): chunks stored, or compressed by bz2 or lz4.

mod reader;
mod record;

pub(crate) use reader::BagMessages;
