//! Topics of the RealSense SDK's recorder: `/device_0/sensor_0/Depth_0/image/data`.
//!
//! Its headers name no frames of reference: a stream's prefix stands for its frame, and `PREFIX/tf/GROUP` holds the
//! transform from the group's reference stream to the stream (librealsense, `ros_file_format.h`). Since 2.58 it writes
//! rosbag2 databases, whose headers name frames; their options are texts.

use super::message_item::MessageItem;

/// Endings of topics, with the messages that they hold.
const OPTION: &str = "/option/Depth_Units/value";

/// Option topics with underscores: some versions write blanks.
fn normalized(topic: &str) -> String {
    topic.replace(' ', "_")
}

/// Prefix of a stream and its reference group, for a topic of extrinsics.
fn extrinsics(topic: &str) -> Option<(&str, &str)> {
    let (stream, group) = topic.rsplit_once("/tf/")?;
    is_of_sdk(stream).then_some((stream, group))
}

fn is_of_sdk(topic: &str) -> bool {
    topic.starts_with("/device_") && topic.contains("/sensor_")
}

/// True for topics of a stream's extrinsics.
pub(super) fn is_extrinsics(topic: &str) -> bool {
    extrinsics(topic).is_some()
}

/// True for topics of metres of a unit of depth.
pub(super) fn is_depth_unit(topic: &str) -> bool {
    is_of_sdk(topic) && normalized(topic).ends_with(OPTION)
}

/// Frame of a stream's images and cameras; `None` for topics of others.
fn stream_of(topic: &str) -> Option<&str> {
    let stream = topic
        .strip_suffix("/image/data")
        .or_else(|| topic.strip_suffix("/info/camera_info"))?;
    is_of_sdk(stream).then_some(stream)
}

/// True if depth units stated under `option` are those of images of `topic`: of the same sensor.
pub(super) fn is_same_sensor(option: &str, topic: &str) -> bool {
    let option = normalized(option);
    let sensor = option.strip_suffix(OPTION).unwrap_or(&option);
    is_of_sdk(topic)
        && topic
            .strip_prefix(sensor)
            .is_some_and(|rest| rest.starts_with('/'))
}

/// True for image topics of the SDK.
pub(super) fn is_image_topic(topic: &str) -> bool {
    stream_of(topic).is_some()
}

/// Fills in the frames of reference that the SDK leaves to the topic.
pub(super) fn with_stream_frames<'a>(topic: &str, mut item: MessageItem<'a>) -> MessageItem<'a> {
    match &mut item {
        MessageItem::Image(image) => {
            if let Some(stream) = stream_of(topic) {
                stream.clone_into(&mut image.frame_id);
            }
        }
        MessageItem::Camera(camera) => {
            if let Some(stream) = stream_of(topic) {
                stream.clone_into(&mut camera.frame_id);
            }
        }
        MessageItem::Transforms(edges) => {
            if let (Some((stream, group)), [edge]) = (extrinsics(topic), edges.as_mut_slice()) {
                stream.clone_into(&mut edge.parent);
                edge.child = format!("reference of group {group}");
            }
        }
        MessageItem::DepthUnit(_) => {}
    }
    item
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_of_the_sdk_are_told_from_others() {
        assert!(is_extrinsics("/device_0/sensor_0/Depth_0/tf/0") && !is_extrinsics("/tf/0"));
        assert!(is_depth_unit("/device_0/sensor_0/option/Depth Units/value"));
        assert!(!is_depth_unit("/device_0/sensor_0/option/Gain/value"));
        let depth = "/device_0/sensor_0/Depth_0/image/data";
        assert!(is_image_topic(depth) && !is_image_topic("/camera/image/data"));
        assert!(is_same_sensor(
            "/device_0/sensor_0/option/Depth_Units/value",
            depth
        ));
        assert!(!is_same_sensor(
            "/device_0/sensor_1/option/Depth_Units/value",
            depth
        ));
    }
}
