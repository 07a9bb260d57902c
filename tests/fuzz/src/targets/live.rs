//! Messages of a live camera of ROS 2.

use super::{Target, text};
use crate::bundle::Bundle;
use mcap::MessageStream;
use std::path::Path;
use tryon::formats::image::{encode_png_depth, encode_png_rgb};
use tryon::formats::live::{LiveCamera, LiveDecoder, LiveMessage, camera_info_topic};
use tryon::geometry::camera::{ColorImage, DepthImage};

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
        let file =
            include_bytes!("../../../../src/formats/testdata/recordings/ros2_mcap/ros2_mcap.mcap");
        let raw = messages(file);
        let compressed = compressed(raw.get("cam.depth.camera_info.bin"));
        vec![raw, compressed.unwrap_or_default()]
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

/// compressedDepth and PNG of the recording's depth camera, 12 × 9.
fn compressed(camera: &[u8]) -> Option<Bundle> {
    let path = Path::new("seed");
    let depth = DepthImage::new(12, 9, (0..108).map(|v| 1000 + v).collect()).ok()?;
    let mut data = vec![0; 12];
    data.extend(encode_png_depth(&depth, path).ok()?);
    let color = encode_png_rgb(&ColorImage::filled(12, 9, [9, 8, 7]), path).ok()?;
    let bundle = Bundle::of(&member("/cam/camera_info"), camera)
        .and(
            &member(STREAMS[1][0]),
            compressed_image("16UC1; compressedDepth png", &data),
        )
        .and(
            &member(STREAMS[1][1]),
            compressed_image("rgb8; png compressed bgr8", &color),
        );
    Some(bundle)
}

/// `sensor_msgs/CompressedImage` in little-endian CDR.
fn compressed_image(format: &str, data: &[u8]) -> Vec<u8> {
    // Representation, second and nanosecond.
    let mut out = vec![0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0];
    for (text, end) in [(b"cam".as_slice(), 1), (format.as_bytes(), 1), (data, 0)] {
        out.resize(out.len().next_multiple_of(4), 0);
        out.extend((text.len() as u32 + end).to_le_bytes());
        out.extend(text);
        out.extend(std::iter::repeat_n(0, end as usize));
    }
    out
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
