//! Liveliness tokens of a subscriber, as nodes of `rmw_zenoh` have them.
//!
//! Drivers and image_transport count the subscribers of a topic, by type, and publish nothing without one. The bridge needs
//! none: it follows the subscriptions themselves.

use super::keys::TopicKeys;
use tryon_formats::live::ros_type_by_name;
use zenoh::liveliness::LivelinessToken;
use zenoh::{Session, Wait};

/// Name under which ROS lists this program.
const NODE: &str = "tryon_capture";
/// Quality of service in a token: best effort, the last five messages. Publishers of any quality match it.
const QOS: &str = "2::,5:,:,:,,";
/// Types of messages and their hashes (REP 2011), the same from Iron on.
const HASHES: [(&str, &str); 4] = [
    (
        "sensor_msgs/msg/Image",
        "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
    ),
    (
        "sensor_msgs/msg/CompressedImage",
        "RIHS01_15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a",
    ),
    (
        "sensor_msgs/msg/CameraInfo",
        "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275",
    ),
    (
        "tf2_msgs/msg/TFMessage",
        "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    ),
];

/// Shows a subscriber of each topic while it is held.
pub(super) struct Presence {
    _tokens: Vec<LivelinessToken>,
}

impl Presence {
    /// Declares the tokens.
    ///
    /// # Errors
    /// A session that has been closed.
    pub(super) fn declare<'a>(
        session: &Session,
        keys: &TopicKeys,
        topics: impl IntoIterator<Item = &'a str>,
    ) -> Result<Self, zenoh::Error> {
        let id = session.zid().to_string();
        let readers = topics.into_iter().enumerate();
        let readers = readers.map(|(k, topic)| reader_token(keys.domain(), &id, k + 1, topic));
        let node = node_token(keys.domain(), &id);
        let tokens = std::iter::once(node).chain(readers);
        let declare = |token| session.liveliness().declare_token(token).wait();
        Ok(Self {
            _tokens: tokens.map(declare).collect::<Result<_, _>>()?,
        })
    }
}

fn node_token(domain: u32, session: &str) -> String {
    format!("@ros2_lv/{domain}/{session}/0/0/NN/%/%/{NODE}")
}

/// Token of a subscriber; `number` is that of the entity within the node.
fn reader_token(domain: u32, session: &str, number: usize, topic: &str) -> String {
    let schema = ros_type_by_name(topic);
    let hash = HASHES.iter().find(|(name, _)| *name == schema);
    let hash = hash.map_or("TypeHashNotSupported", |(_, hash)| hash);
    let dds = match schema.rsplit_once('/') {
        Some((package, name)) => format!("{}::dds_::{name}_", package.replace('/', "::")),
        None => schema.to_owned(),
    };
    let topic = topic.replace('/', "%");
    format!("@ros2_lv/{domain}/{session}/0/{number}/MS/%/%/{NODE}/{topic}/{dds}/{hash}/{QOS}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_those_of_a_node_and_of_its_subscribers() {
        // The form of rmw_zenoh's docs/design.md.
        assert_eq!(
            node_token(0, "aac3178e146ba6f1fc6e6a4085e77f21"),
            "@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/tryon_capture"
        );
        let hash = "RIHS01_15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a";
        assert_eq!(
            reader_token(7, "a1", 2, "/cam/depth/image/compressedDepth"),
            format!(
                "@ros2_lv/7/a1/0/2/MS/%/%/tryon_capture/%cam%depth%image%compressedDepth/\
                 sensor_msgs::msg::dds_::CompressedImage_/{hash}/2::,5:,:,:,,"
            )
        );
        for topic in ["/d/image_raw", "/d/camera_info", "/tf_static"] {
            let token = reader_token(0, "a1", 1, topic);
            assert!(token.contains("/RIHS01_"), "{token}");
            assert!(zenoh::key_expr::KeyExpr::try_from(token).is_ok());
        }
    }
}
