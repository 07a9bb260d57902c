//! Messages of a live camera of ROS 2.

use super::{Target, text};
use crate::bundle::Bundle;
use mcap::MessageStream;
use std::path::Path;
use tryon::formats::live::{LiveCamera, LiveDecoder, LiveMessage, camera_info_topic};

/// Streams: raw, and compressed.
const STREAMS: [[&str; 2]; 2] = [
    ["/cam/depth/image_raw", "/cam/color/image_raw"],
    ["/cam/depth/compressedDepth", "/cam/rgb/compressed"],
];
const TF_STATIC: &str = "/tf_static";

/// A message of each topic, as the CDR of ROS 2.
pub(super) const LIVE: Target = Target::new(
    "ros2-live",
    "src/formats/messages/live",
    |b, _| frame(b),
    || {
        let files = [
            &include_bytes!("../../../../src/formats/testdata/recordings/ros2_mcap/ros2_mcap.mcap")
                [..],
            include_bytes!("../../../../src/formats/testdata/recordings/compressed_ros2.mcap"),
        ];
        files.map(messages).to_vec()
    },
)
.words("16UC1 32FC1 mono16 rgb8 bgr8 yuv422 jpeg png compressedDepth plumb_bob rational_polynomial")
.allow(1 << 20, 400);

/// Name of the member with a topic's message.
fn member(topic: &str) -> String {
    format!("{}.bin", topic.trim_start_matches('/').replace('/', "."))
}

/// The first message of each topic of an MCAP file.
fn messages(file: &[u8]) -> Bundle {
    let mut bundle = Bundle::default();
    for message in MessageStream::new(file).into_iter().flatten().flatten() {
        let name = member(&message.channel.topic);
        if bundle.get(&name).is_empty() {
            bundle = bundle.and(&name, message.data.into_owned());
        }
    }
    bundle
}

fn frame(b: &Bundle) -> Result<usize, String> {
    let of = |topic: &str| b.get(&member(topic));
    let [depth, color] = STREAMS[usize::from(of(STREAMS[0][0]).is_empty())];
    let mut camera = LiveCamera::new(Path::new("ros2"), depth, Some(color));
    for topic in [&camera_info_topic(depth), &camera_info_topic(color)] {
        camera.insert(topic, None, of(topic)).map_err(text)?;
    }
    if camera.lacks_transform() {
        camera
            .insert(TF_STATIC, None, of(TF_STATIC))
            .map_err(text)?;
    }
    let mut frames = camera.frames().map_err(text)?;
    let image = |decoder: &LiveDecoder, topic| {
        decoder.image(LiveMessage {
            topic,
            schema: None,
            data: b.get(&member(topic)),
            arrived_ns: 1,
            number: 1,
        })
    };
    let found = image(frames.decoder(), depth).map_err(text)?;
    let mut colors = 1;
    let next = |decoder: &LiveDecoder, _| {
        let is_left = std::mem::take(&mut colors) > 0;
        is_left.then(|| image(decoder, color)).transpose()
    };
    let frame = frames.frame(found, next).map_err(text)?;
    let color = frame.color.map_or(0, |c| c.data().len());
    Ok(frame.depth.data().len() + color)
}
