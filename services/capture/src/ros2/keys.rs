//! Keys of topics on zenoh.
//!
//! - `rmw_zenoh`: `DOMAIN/TOPIC/TYPE/HASH`, and a liveliness token of each publisher,
//!   `@ros2_lv/DOMAIN/SESSION/NODE/ID/MP/ENCLAVE/NAMESPACE/NODE_NAME/TOPIC/TYPE/HASH/QOS` with `%` for slashes
//!   (its `docs/design.md`).
//! - `zenoh-plugin-ros2dds`: the topic, after a namespace if the bridge has one; tokens
//!   `@/SESSION/@ros2_lv/MP/KEY/TYPE/QOS`, before 1.0 `@ros2_lv/SESSION/MP/KEY/TYPE/QOS`, with `§` for slashes.
//!
//! Both carry messages as CDR with its header. `rmw_zenoh` attaches sequence number, time of sending and identity of the
//! publisher, of which nothing is needed: images have capture times.

use tryon_kit::config::Ros2Config;

/// Key expressions of all tokens of publishers.
pub(super) const TOKENS: [&str; 2] = ["@ros2_lv/**", "@/*/@ros2_lv/**"];
/// End of the key of a publisher's cache of past messages (zenoh's advanced publisher).
const CACHE: &str = "@adv/pub/**";
/// Beginnings of hashes of types: REP 2011, and distributions before it.
const HASHES: [&str; 2] = ["RIHS", "TypeHashNotSupported"];

/// Keys of one network.
#[derive(Clone, Debug)]
pub(super) struct TopicKeys {
    domain: u32,
    /// Without slashes around it; empty for none.
    namespace: String,
}

/// A key that is none of the topic's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the key is of another topic")]
pub(super) struct ForeignKey;

impl TopicKeys {
    pub(super) fn new(config: &Ros2Config) -> Self {
        Self {
            domain: config.domain,
            namespace: config.namespace.trim_matches('/').to_owned(),
        }
    }

    /// ROS_DOMAIN_ID.
    pub(super) fn domain(&self) -> u32 {
        self.domain
    }

    /// Key of the bridge.
    fn bridged(&self, topic: &str) -> String {
        let path = topic.trim_start_matches('/');
        match self.namespace.as_str() {
            "" => path.to_owned(),
            namespace => format!("{namespace}/{path}"),
        }
    }

    /// Beginning of the key of `rmw_zenoh`.
    fn prefix(&self, topic: &str) -> String {
        format!("{}/{}/", self.domain, topic.trim_start_matches('/'))
    }

    /// Key expressions of a topic's messages.
    pub(super) fn of(&self, topic: &str) -> [String; 2] {
        [format!("{}*/*", self.prefix(topic)), self.bridged(topic)]
    }

    /// Selectors of a topic's past messages, of publishers that keep them.
    pub(super) fn past(&self, topic: &str) -> Vec<String> {
        let of = self.of(topic).into_iter();
        of.flat_map(|key| [format!("{key}/{CACHE}?_anyke"), key])
            .collect()
    }

    /// Topic that a token announces, under the name that it has in the configuration: without the bridge's namespace.
    pub(super) fn announced(&self, token: &str) -> Option<Announced> {
        let mut announced = Announced::of(token)?;
        let namespace = format!("/{}/", self.namespace);
        let local = announced.topic.strip_prefix(&namespace);
        if let Some(local) = local.filter(|_| announced.domain.is_none()) {
            announced.topic = format!("/{local}");
        }
        Some(announced)
    }

    /// Type that a key of the topic states; `None` for keys of the bridge, which state none.
    ///
    /// # Errors
    /// A key of another topic.
    pub(super) fn schema<'a>(
        &self,
        topic: &str,
        key: &'a str,
    ) -> Result<Option<&'a str>, ForeignKey> {
        if key == self.bridged(topic) {
            return Ok(None);
        }
        let rest = key.strip_prefix(&self.prefix(topic)).ok_or(ForeignKey)?;
        match rest.split_once('/') {
            Some((schema, hash)) if is_type(schema) && is_hash(hash) => Ok(Some(schema)),
            _ => Err(ForeignKey),
        }
    }
}

/// True for DDS's name of a type: `sensor_msgs::msg::dds_::Image_`.
fn is_type(chunk: &str) -> bool {
    chunk.contains("::") && !chunk.contains('/')
}

fn is_hash(chunk: &str) -> bool {
    !chunk.contains('/') && HASHES.iter().any(|h| chunk.starts_with(h))
}

/// Topic that somebody publishes, by a token.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Announced {
    pub(super) topic: String,
    pub(super) schema: String,
    /// Domain of `rmw_zenoh`.
    pub(super) domain: Option<u32>,
}

impl Announced {
    /// Topic of a publisher's token; `None` for tokens of others.
    fn of(token: &str) -> Option<Self> {
        let chunks: Vec<&str> = token.split('/').collect();
        let bridged = |key: &str, schema: &str| Self {
            topic: format!("/{}", key.replace('§', "/")),
            schema: schema.replace('§', "/"),
            domain: None,
        };
        match chunks[..] {
            [
                "@ros2_lv",
                domain,
                _,
                _,
                _,
                "MP",
                _,
                _,
                _,
                topic,
                schema,
                _,
                _,
            ] => Some(Self {
                topic: topic.replace('%', "/"),
                schema: schema.replace('%', "/"),
                domain: Some(domain.parse().ok()?),
            }),
            ["@", _, "@ros2_lv", "MP", key, schema, _] | ["@ros2_lv", _, "MP", key, schema, _] => {
                Some(bridged(key, schema))
            }
            _ => None,
        }
    }
}

impl std::fmt::Display for Announced {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "`{}` ({}", self.topic, self.schema)?;
        if let Some(domain) = self.domain {
            write!(f, ", domain {domain}")?;
        }
        f.write_str(")")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMAGE: &str = "sensor_msgs::msg::dds_::Image_";
    const HASH: &str = "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47";
    const TOPIC: &str = "/camera/depth/image_rect_raw";

    fn keys(domain: u32, namespace: &str) -> TopicKeys {
        TopicKeys::new(&Ros2Config {
            domain,
            namespace: namespace.into(),
            ..Ros2Config::default()
        })
    }

    #[test]
    fn both_forms_of_a_topic_are_subscribed() {
        assert_eq!(
            keys(0, "").of(TOPIC),
            [
                "0/camera/depth/image_rect_raw/*/*",
                "camera/depth/image_rect_raw"
            ]
        );
        assert_eq!(
            keys(42, "/robot1/").of("/tf_static"),
            ["42/tf_static/*/*", "robot1/tf_static"]
        );
        for topic in [TOPIC, "/tf_static"] {
            let keys = keys(42, "robot1");
            for key in keys.of(topic) {
                assert!(zenoh::key_expr::KeyExpr::try_from(key).is_ok());
            }
            for selector in keys.past(topic) {
                assert!(zenoh::query::Selector::try_from(selector).is_ok());
            }
        }
    }

    #[test]
    fn types_are_read_from_keys_of_rmw_zenoh_alone() {
        let keys = keys(0, "");
        let schema = |key: &str| keys.schema(TOPIC, key).map(|s| s.map(str::to_owned));
        let own = "camera/depth/image_rect_raw";
        let image = Ok(Some(IMAGE.to_owned()));
        assert_eq!(schema(&format!("0/{own}/{IMAGE}/{HASH}")), image);
        let humble = format!("0/{own}/{IMAGE}/TypeHashNotSupported");
        assert_eq!(schema(&humble), image);
        assert_eq!(schema(own), Ok(None));
        for foreign in [
            String::new(),
            format!("1/{own}/{IMAGE}/{HASH}"),
            format!("0/{own}/{IMAGE}"),
            format!("0/{own}/{IMAGE}/{HASH}/more"),
            format!("0/{own}/Image/{HASH}"),
            format!("0/{own}/{IMAGE}/hash"),
            format!("0/{own}/compressed/{IMAGE}/{HASH}"),
            format!("0/{own}2/{IMAGE}/{HASH}"),
            format!("{own}/compressed"),
        ] {
            assert_eq!(schema(&foreign), Err(ForeignKey), "{foreign}");
        }
    }

    #[test]
    fn tokens_name_topics_with_their_slashes() {
        // The first is of rmw_zenoh's docs/design.md.
        let chatter = "@ros2_lv/0/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/\
            std_msgs::msg::dds_::String_/RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18/::,7:,:,:,,";
        let chatter = Announced::of(chatter).expect("a publisher");
        assert_eq!(
            chatter.to_string(),
            "`/chatter` (std_msgs::msg::dds_::String_, domain 0)"
        );
        let camera = format!(
            "@ros2_lv/7/a/1/2/MP/%/%camera%front/driver/%camera%depth%image_rect_raw/{IMAGE}/{HASH}/2::,5:,:,:,,"
        );
        let camera = Announced::of(&camera).expect("a publisher");
        assert_eq!((camera.topic.as_str(), camera.domain), (TOPIC, Some(7)));
        for bridged in [
            "@/8b20/@ros2_lv/MP/camera§depth§image_rect_raw/sensor_msgs§msg§Image/:1:1:1,5",
            "@ros2_lv/8b20/MP/camera§depth§image_rect_raw/sensor_msgs§msg§Image/:::",
        ] {
            let bridged = Announced::of(bridged).expect("a publisher");
            assert_eq!((bridged.topic.as_str(), bridged.domain), (TOPIC, None));
            assert_eq!(bridged.schema, "sensor_msgs/msg/Image");
        }
        let bridged = "@/8b20/@ros2_lv/MP/robot1§depth/sensor_msgs§msg§Image/:::";
        let named = |namespace: &str| keys(0, namespace).announced(bridged).map(|a| a.topic);
        assert_eq!(named("").as_deref(), Some("/robot1/depth"));
        assert_eq!(named("robot1").as_deref(), Some("/depth"));
        assert_eq!(named("robot").as_deref(), Some("/robot1/depth"));
        for other in [
            "",
            "@ros2_lv",
            "@ros2_lv/0/aac3/0/0/NN/%/%/listener",
            &format!("@ros2_lv/0/a/0/11/MS/%/%/listener/%chatter/{IMAGE}/{HASH}/::,10:,:,:,,"),
            &format!("@ros2_lv/x/a/0/11/MP/%/%/listener/%chatter/{IMAGE}/{HASH}/::,10:,:,:,,"),
            &format!("@ros2_lv/0/a/0/11/MP/%/%/listener/%chatter/{IMAGE}/{HASH}"),
            "@/8b20/@ros2_lv/MS/camera§depth/sensor_msgs§msg§Image/:::",
            "tryon/store/front/rgbd",
        ] {
            assert_eq!(Announced::of(other), None, "{other}");
        }
    }
}
