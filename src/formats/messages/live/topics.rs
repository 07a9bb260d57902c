//! Conventions of ROS topic names: image_transport's suffixes, `camera_info` beside the image.

use crate::messages::ros_messages::RosKind;
use crate::messages::selection::base_topic;

/// Topic of the camera of an image topic: `camera_info` beside it, whatever its transport.
pub fn camera_info_topic(image: &str) -> String {
    let parent = base_topic(image).rsplit_once('/').map_or("", |(p, _)| p);
    format!("{parent}/camera_info")
}

/// Type of a topic's messages by its name, where the bus states none.
pub fn ros_type_by_name(topic: &str) -> &'static str {
    match topic.rsplit('/').next().unwrap_or_default() {
        "compressed" | "compressedDepth" => "sensor_msgs/msg/CompressedImage",
        "camera_info" => "sensor_msgs/msg/CameraInfo",
        "tf" | "tf_static" => "tf2_msgs/msg/TFMessage",
        _ => "sensor_msgs/msg/Image",
    }
}

/// True for the types of raw and compressed images: `sensor_msgs/msg/Image` or `sensor_msgs::msg::dds_::Image_`.
pub fn is_ros_image_type(schema: &str) -> bool {
    RosKind::of(schema).is_some_and(RosKind::is_image)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_lie_beside_their_images() {
        for (image, camera) in [
            ("/camera/depth/image_rect_raw", "/camera/depth/camera_info"),
            ("/cam/rgb/image/compressed", "/cam/rgb/camera_info"),
            ("/cam/depth/image/compressedDepth", "/cam/depth/camera_info"),
            ("/image", "/camera_info"),
            ("image", "/camera_info"),
        ] {
            assert_eq!(camera_info_topic(image), camera);
        }
    }

    #[test]
    fn types_follow_from_suffixes() {
        assert!(is_ros_image_type(ros_type_by_name("/c/image_raw")));
        assert!(is_ros_image_type(
            "sensor_msgs::msg::dds_::CompressedImage_"
        ));
        assert!(ros_type_by_name("/c/image/compressedDepth").ends_with("CompressedImage"));
        for other in ["/c/camera_info", "/tf_static"] {
            assert!(!is_ros_image_type(ros_type_by_name(other)), "{other}");
        }
    }
}
