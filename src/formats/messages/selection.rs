//! Choice of the depth and the colour topic of a recording, and an account of the others.

use super::container::TopicChannel;
use super::fault::MessageFault;
use super::image_layout::PixelContent;
use super::survey::{ImageTopic, Survey};
use std::sync::Arc;

/// Names of topics that one line of the account holds.
const MOST_NAMES: usize = 12;

/// Kinds of pixels that are depth, and that are colour.
const DEPTH: [PixelContent; 2] = [PixelContent::Depth, PixelContent::Grey16];
const COLOR: [PixelContent; 2] = [PixelContent::Color, PixelContent::Grey];

/// Topics wished for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TopicWish<'a> {
    pub(super) depth: Option<&'a str>,
    pub(super) color: Option<&'a str>,
}

/// Chosen topics.
#[derive(Debug)]
pub(super) struct Selection<'a> {
    pub(super) depth: &'a ImageTopic,
    pub(super) color: Option<&'a ImageTopic>,
    /// Topics that are not taken and why, and what is assumed.
    pub(super) notes: Vec<String>,
}

/// Words of a topic's name, in lower case.
fn words(topic: &str) -> impl Iterator<Item = String> {
    let words = topic.split(|c: char| !c.is_alphanumeric());
    words.filter(|w| !w.is_empty()).map(str::to_lowercase)
}

/// True for names with `depth` in them.
fn is_named_depth(topic: &str) -> bool {
    words(topic).any(|w| w.starts_with("depth"))
}

/// True for names of infrared images: `ir`, `infra1`, `image_ir`.
fn is_named_infrared(topic: &str) -> bool {
    !is_named_depth(topic) && words(topic).any(|w| w == "ir" || w.starts_with("infra"))
}

/// Topic of the raw image that a compressed one repeats.
pub(super) fn base_topic(topic: &str) -> &str {
    ["/compressedDepth", "/compressed"]
        .iter()
        .find_map(|suffix| topic.strip_suffix(suffix))
        .unwrap_or(topic)
}

/// Path segments that two topics begin with alike.
pub(super) fn shared_segments(a: &str, b: &str) -> usize {
    let pairs = base_topic(a).split('/').zip(base_topic(b).split('/'));
    pairs.take_while(|(a, b)| a == b).count()
}

impl Survey {
    /// Chooses the topics.
    ///
    /// # Errors
    /// A wished topic that is missing or not read, no depth, or several topics of which none is distinguished.
    pub(super) fn select(&self, wish: TopicWish<'_>) -> Result<Selection<'_>, MessageFault> {
        let depth = match wish.depth {
            Some(name) => self.named(name, "depth topic", DEPTH)?,
            None => self.only_depth()?,
        };
        let color = match wish.color {
            Some(name) => Some(self.named(name, "color topic", COLOR)?),
            None => self.nearest_color(depth)?,
        };
        let mut selection = Selection {
            depth,
            color,
            notes: Vec::new(),
        };
        if depth.content == PixelContent::Grey16 {
            let why = "16-bit grey is taken as depth, since no topic has 16UC1 or 32FC1";
            selection.notes.push(format!("{depth}: {why}"));
        }
        self.name_the_rest(&mut selection);
        Ok(selection)
    }

    /// The topic of a name, whose pixels are of one of these kinds.
    fn named(
        &self,
        name: &str,
        field: &str,
        contents: [PixelContent; 2],
    ) -> Result<&ImageTopic, MessageFault> {
        let fault = |start: String| {
            let why = format!("{start}; image topics: {}", self.listed());
            MessageFault::new(field, why)
        };
        match self.images.get(name) {
            None => Err(fault(format!("no images under `{name}`"))),
            Some(t) if !contents.contains(&t.content) => Err(fault(format!("not {t}"))),
            Some(topic) => Ok(topic),
        }
    }

    /// Image topics, or a word that there are none.
    fn listed(&self) -> String {
        let names: Vec<String> = self.images.values().map(ToString::to_string).collect();
        match names.is_empty() {
            true => "none".into(),
            false => names.join(", "),
        }
    }

    /// Topics of the first of these kinds that has any, without infrared and repetitions.
    fn candidates(&self, contents: [PixelContent; 2]) -> Vec<&ImageTopic> {
        let of = |content: PixelContent| {
            let topics = self.images.values();
            let is_meant = |t: &&ImageTopic| t.content == content && !is_named_infrared(&t.topic);
            without_twins(topics.filter(is_meant).collect())
        };
        let found = contents.map(of);
        found
            .into_iter()
            .find(|c| !c.is_empty())
            .unwrap_or_default()
    }

    fn only_depth(&self) -> Result<&ImageTopic, MessageFault> {
        let mut candidates = self.candidates(DEPTH);
        if candidates.len() > 1 && candidates.iter().any(|t| is_named_depth(&t.topic)) {
            candidates.retain(|t| is_named_depth(&t.topic));
        }
        match candidates[..] {
            [one] => Ok(one),
            [] => {
                let mut why = format!(
                    "no depth image (16UC1, 32FC1, compressedDepth or mono16); image topics: {}",
                    self.listed()
                );
                for note in unread_channels(&self.channels) {
                    why.push_str("; ");
                    why.push_str(&note);
                }
                Err(MessageFault::new("depth topic", why))
            }
            _ => Err(ambiguous("depth", &candidates)),
        }
    }

    /// The colour topic that shares most of its path with the depth topic; grey only without colour.
    fn nearest_color(&self, depth: &ImageTopic) -> Result<Option<&ImageTopic>, MessageFault> {
        let mut candidates = self.candidates(COLOR);
        let keys = candidates
            .iter()
            .map(|t| shared_segments(&t.topic, &depth.topic));
        let most = keys.max().unwrap_or(0);
        candidates.retain(|t| shared_segments(&t.topic, &depth.topic) == most);
        match candidates[..] {
            [] => Ok(None),
            [one] => Ok(Some(one)),
            _ => Err(ambiguous("color", &candidates)),
        }
    }

    /// Accounts for every topic that is not chosen.
    fn name_the_rest(&self, selection: &mut Selection<'_>) {
        let is_chosen = |topic: &str| {
            selection.depth.topic == topic || selection.color.is_some_and(|c| c.topic == topic)
        };
        let others = self.images.values().filter(|t| !is_chosen(&t.topic));
        let mut notes: Vec<String> = others
            .map(|t| format!("{t}: {}", reason(t, selection)))
            .collect();
        notes.extend(other_channels(&self.channels));
        selection.notes.append(&mut notes);
    }
}

/// Leaves out compressed topics whose raw twin is there.
fn without_twins(mut topics: Vec<&ImageTopic>) -> Vec<&ImageTopic> {
    let names: Vec<&str> = topics.iter().map(|t| t.topic.as_str()).collect();
    topics.retain(|t| {
        let base = base_topic(&t.topic);
        base == t.topic || !names.contains(&base)
    });
    topics
}

fn ambiguous(stream: &str, candidates: &[&ImageTopic]) -> MessageFault {
    let names: Vec<String> = candidates.iter().map(ToString::to_string).collect();
    let why = format!(
        "several: {}; choose one with --{stream}-topic",
        names.join(", ")
    );
    MessageFault::new(format!("{stream} topic"), why)
}

/// Reason why an image topic is not taken.
fn reason(topic: &ImageTopic, selection: &Selection<'_>) -> String {
    let (depth, color) = (selection.depth, selection.color);
    let taken = |t: &ImageTopic| format!("not taken, `{}` is", t.topic);
    match (topic.content, color) {
        (PixelContent::Unread, _) => "its encoding is not read".into(),
        _ if is_named_infrared(&topic.topic) => "infrared is not taken".into(),
        (PixelContent::Depth | PixelContent::Grey16, _) => taken(depth),
        (PixelContent::Color | PixelContent::Grey, Some(color)) => taken(color),
        (PixelContent::Color | PixelContent::Grey, None) => "not taken".into(),
    }
}

/// Account of channels of images and cameras in an encoding that is not read.
fn unread_channels(channels: &[Arc<TopicChannel>]) -> Vec<String> {
    let unread = channels
        .iter()
        .filter(|c| c.kind.is_none() && is_of_images(c));
    unread
        .map(|c| {
            let (topic, schema, encoding) = (&c.topic, &c.schema, &c.encoding);
            format!("`{topic}`: {schema} in the encoding `{encoding}` is not read")
        })
        .collect()
}

fn is_of_images(channel: &TopicChannel) -> bool {
    let schema = channel.schema.trim_end_matches('_');
    let ends = ["Image", "CameraCalibration", "CameraInfo"];
    ends.iter().any(|end| schema.ends_with(end))
}

/// Account of channels without a part in RGBD frames: one line for each of images, one for all others.
pub(super) fn other_channels(channels: &[Arc<TopicChannel>]) -> Vec<String> {
    let mut notes = unread_channels(channels);
    let others = channels
        .iter()
        .filter(|c| c.kind.is_none() && !is_of_images(c));
    let mut names: Vec<String> = others
        .map(|c| format!("`{}` ({})", c.topic, c.schema))
        .collect();
    names.sort();
    names.dedup();
    if !names.is_empty() {
        let more = names.len().saturating_sub(MOST_NAMES);
        names.truncate(MOST_NAMES);
        let tail = match more {
            0 => String::new(),
            n => format!(" and {n} more"),
        };
        let names = names.join(", ");
        notes.push(format!("{names}{tail}: no part in depth and colour"));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn survey(topics: &[(&str, PixelContent)]) -> Survey {
        let mut survey = Survey::default();
        for (name, content) in topics {
            let topic = ImageTopic {
                topic: (*name).into(),
                schema: "sensor_msgs/msg/Image".into(),
                content: *content,
                encoding: "e".into(),
                frame_id: "f".into(),
                size: Some((4, 3)),
                depth_unit: None,
                has_stamps: true,
                images: 1,
            };
            survey.images.insert((*name).into(), topic);
        }
        survey
    }

    fn chosen(topics: &[(&str, PixelContent)]) -> Result<(String, Option<String>), String> {
        let survey = survey(topics);
        let selection = survey.select(TopicWish::default()).map_err(|f| f.why)?;
        let color = selection.color.map(|c| c.topic.clone());
        Ok((selection.depth.topic.clone(), color))
    }

    #[test]
    fn depth_is_told_from_infrared_and_color_by_its_path() {
        use PixelContent::{Color, Depth, Grey, Grey16};
        let one = chosen(&[
            ("/kinect2/sd/image_depth", Depth),
            ("/kinect2/sd/image_ir", Depth),
            ("/kinect2/sd/image_mono", Grey),
            ("/kinect2/sd/image_color", Color),
        ]);
        let want = ("/kinect2/sd/image_depth", "/kinect2/sd/image_color");
        assert_eq!(one, Ok((want.0.into(), Some(want.1.into()))));
        let two = chosen(&[
            ("/a/depth/image", Depth),
            ("/a/color/image", Color),
            ("/b/color/image", Color),
            ("/b/ir/image", Grey16),
        ]);
        assert_eq!(
            two,
            Ok(("/a/depth/image".into(), Some("/a/color/image".into())))
        );
        let grey = chosen(&[("/d", Grey16), ("/infra1/image", Grey)]);
        assert_eq!(grey, Ok(("/d".into(), None)));
        let twins = chosen(&[
            ("/depth/image", Depth),
            ("/depth/image/compressedDepth", Depth),
        ]);
        assert_eq!(twins, Ok(("/depth/image".into(), None)));
    }

    #[test]
    fn several_candidates_are_listed_and_choosable() {
        use PixelContent::{Color, Depth};
        let topics = [("/a/depth", Depth), ("/b/depth", Depth), ("/c", Color)];
        let e = chosen(&topics).expect_err("two");
        assert!(
            e.contains("`/a/depth`") && e.contains("`/b/depth`") && e.contains("--depth-topic"),
            "{e}"
        );
        let survey = survey(&topics);
        let wish = TopicWish {
            depth: Some("/b/depth"),
            color: None,
        };
        let selection = survey.select(wish).expect("chosen");
        assert_eq!(selection.depth.topic, "/b/depth");
        assert!(selection.notes.iter().any(|n| n.contains("`/a/depth`")));
        let wish = TopicWish {
            depth: Some("/x"),
            color: None,
        };
        assert!(survey.select(wish).is_err_and(|e| e.why.contains("`/x`")));
        let wish = TopicWish {
            depth: Some("/c"),
            color: None,
        };
        assert!(
            survey
                .select(wish)
                .is_err_and(|e| e.why.starts_with("not `/c`"))
        );
    }

    #[test]
    fn other_topics_are_named_once() {
        let mut channels = vec![Arc::new(TopicChannel::new(
            "/c",
            "foxglove.RawImage",
            "json",
        ))];
        for i in 0..20 {
            let c = TopicChannel::new(&format!("/imu{i}"), "sensor_msgs/msg/Imu", "cdr");
            channels.push(Arc::new(c));
        }
        let notes = other_channels(&channels);
        assert_eq!(notes.len(), 2);
        assert!(notes[0].contains("`json`") && notes[1].contains("and 8 more"));
    }
}
