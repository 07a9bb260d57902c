//! Live messages that rosbags serialised (`testdata/recordings/make_recordings.py`), late, lost, displaced and damaged.

use super::*;
use crate::FormatError;
use crate::messages::MessageContainer;
use crate::messages::recorded_tests::{check_frame, expected, recording};
use std::collections::VecDeque;
use std::path::Path;
use std::time::Duration;
use tryon_geometry::camera::RgbdFrame;

const MS: u64 = 1_000_000;
/// Time of the first depth image, and between two (make_recordings.py), nanoseconds.
const START: u64 = 1_700_000_000_000_000_000;
const PERIOD: u64 = 33_333_333;

/// A message as recorded.
#[derive(Clone)]
struct Recorded {
    topic: String,
    schema: String,
    data: Vec<u8>,
}

impl Recorded {
    fn message(&self) -> LiveMessage<'_> {
        LiveMessage {
            topic: &self.topic,
            schema: Some(&self.schema),
            data: &self.data,
            arrived_ns: 7,
            number: 1,
        }
    }
    /// The same with another stamp, in the little-endian CDR of rosbags.
    fn at(&self, time_ns: u64) -> Self {
        let mut moved = self.clone();
        let second = 1_000_000_000;
        for (i, part) in [time_ns / second, time_ns % second].into_iter().enumerate() {
            let part = u32::try_from(part).expect("before 2106").to_le_bytes();
            moved.data[4 + 4 * i..][..4].copy_from_slice(&part);
        }
        moved
    }
}

fn messages(name: &str) -> Vec<Recorded> {
    let path = recording(name);
    let mut container: Box<dyn MessageContainer> = match path.is_dir() {
        true => crate::rosbag2::open_folder(&path).expect("opens"),
        false => crate::mcap_file::McapMessages::open(&path).expect("opens"),
    };
    let (mut all, mut data) = (Vec::new(), Vec::new());
    while let Some(head) = container.next_message(&|_| true, &mut data).expect("whole") {
        all.push(Recorded {
            topic: head.channel.topic.clone(),
            schema: head.channel.schema.clone(),
            data: data.clone(),
        });
    }
    all
}

fn of<'a>(all: &'a [Recorded], topic: &str) -> Vec<&'a Recorded> {
    let found: Vec<_> = all.iter().filter(|m| m.topic == topic).collect();
    assert!(!found.is_empty(), "{topic}");
    found
}

/// Camera of two topics that has what a recording states of it.
fn camera(all: &[Recorded], depth: &str, color: &str) -> LiveCamera {
    let mut camera = LiveCamera::new(Path::new("ros2"), depth, Some(color));
    for topic in camera.info_topics() {
        assert!(camera.missing().contains(&topic));
        let info = of(all, &topic)[0];
        camera
            .insert(&topic, Some(&info.schema), &info.data)
            .expect("a camera");
    }
    assert!(camera.missing().is_empty());
    for tf in all.iter().filter(|m| m.topic == "/tf_static") {
        assert!(camera.lacks_transform());
        camera
            .insert(&tf.topic, None, &tf.data)
            .expect("transforms");
    }
    assert!(!camera.lacks_transform());
    camera
}

const DEPTH: &str = "/cam/depth/image_raw";
const COLOR: &str = "/cam/color/image_raw";

/// Frame of depth with the colours that wait for it, and the longest wait asked for.
fn frame(
    frames: &mut LiveFrames,
    depth: &Recorded,
    colors: &mut VecDeque<Recorded>,
) -> (Result<RgbdFrame, FormatError>, Duration) {
    let mut longest = Duration::ZERO;
    let image = frames.decoder().image(depth.message()).expect("an image");
    let next = |decoder: &LiveDecoder, wait: Duration| {
        longest = longest.max(wait);
        let color = colors.pop_front();
        color.map(|c| decoder.image(c.message())).transpose()
    };
    (frames.frame(image, next), longest)
}

#[test]
fn frames_are_those_of_the_recording() {
    for (name, depth, color) in [
        ("ros2_sqlite", DEPTH, COLOR),
        (
            "compressed_ros2.mcap",
            "/cam/depth/compressedDepth",
            "/cam/rgb/compressed",
        ),
    ] {
        let all = messages(name);
        let mut frames = camera(&all, depth, color).frames().expect("calibrated");
        let mut colors = of(&all, color).into_iter().cloned().collect();
        let expected = expected();
        let want = expected[name]["frames"].as_array().expect("frames");
        for (message, want) in of(&all, depth).iter().zip(want) {
            let (got, _) = frame(&mut frames, message, &mut colors);
            check_frame(&got.expect("decodes"), want, name);
        }
        assert_eq!(frames.unpaired(), UnpairedDepth::default());
        let file = crate::recording::open_as_recorded(&recording(name)).expect("opens");
        assert_eq!(frames.lenses(), file.lenses(), "{name}");
    }
}

#[test]
fn depth_waits_half_a_period_for_its_color_and_no_longer() {
    let all = messages("ros2_sqlite");
    let mut frames = camera(&all, DEPTH, COLOR).frames().expect("calibrated");
    let (depth, color) = (of(&all, DEPTH)[0], of(&all, COLOR)[0]);
    let mut colors = VecDeque::new();
    let mut next = |k: u64, color_at: &[u64]| {
        colors.extend(color_at.iter().map(|t| color.at(*t)));
        let depth = depth.at(START + k * PERIOD);
        let (got, wait) = frame(&mut frames, &depth, &mut colors);
        (
            got.expect("decodes").color.is_some(),
            wait,
            frames.unpaired(),
        )
    };
    let half = Duration::from_nanos(PERIOD / 2);
    // No colour: half a period was asked for.
    let (is_colored, wait, unpaired) = next(0, &[]);
    assert_eq!((is_colored, wait, unpaired.offset_ns), (false, half, None));
    // Colour of the frame before, which is late, and then its own.
    let own = START + PERIOD + 8 * MS;
    let (is_colored, wait, _) = next(1, &[START + 8 * MS, own]);
    assert_eq!((is_colored, wait), (true, half));
    // A colour before depth that is near enough is not outbid by one that would have to be waited for.
    let (is_colored, wait, _) = next(2, &[START + 2 * PERIOD - 8 * MS]);
    assert_eq!((is_colored, wait), (true, half));
    let (is_colored, _, unpaired) = next(3, &[START + 4 * PERIOD - 8 * MS]);
    assert!(!is_colored, "it belongs to the next depth image");
    assert_eq!((unpaired.in_a_row, unpaired.total), (1, 2));
    let (is_colored, wait, unpaired) = next(4, &[]);
    assert_eq!((is_colored, wait), (true, Duration::ZERO));
    assert_eq!((unpaired.in_a_row, unpaired.total), (0, 2));
}

#[test]
fn streams_of_two_clocks_are_measured_and_found_again() {
    let all = messages("ros2_sqlite");
    let mut frames = camera(&all, DEPTH, COLOR).frames().expect("calibrated");
    let (depth, color) = (of(&all, DEPTH)[0], of(&all, COLOR)[0]);
    let mut colors = VecDeque::new();
    let hour = 3_600_000 * MS;
    for (round, offset) in [hour as i64, -(hour as i64), 300 * MS as i64]
        .into_iter()
        .enumerate()
    {
        for k in 0..4 {
            let at = START + (20 * round as u64 + k) * PERIOD;
            colors.push_back(color.at(at.saturating_add_signed(offset)));
            let (got, _) = frame(&mut frames, &depth.at(at), &mut colors);
            assert!(got.expect("decodes").color.is_none());
            let found = frames.unpaired();
            assert_eq!(found.offset_ns, Some(offset), "{round} {k}");
        }
        // The clocks agree again.
        let at = START + (20 * round as u64 + 4) * PERIOD;
        colors.push_back(color.at(at));
        let (got, _) = frame(&mut frames, &depth.at(at), &mut colors);
        assert!(got.expect("decodes").color.is_some(), "{round}");
    }
    assert_eq!(frames.unpaired().total, 12);
}

#[test]
fn what_is_missing_and_what_is_no_camera_is_named() {
    let all = messages("ros2_sqlite");
    let mut camera = LiveCamera::new(Path::new("ros2"), DEPTH, Some(COLOR));
    let both = ["/cam/depth/camera_info", "/cam/color/camera_info"];
    assert_eq!(camera.info_topics(), both);
    let e = camera.frames().expect_err("nothing is known").to_string();
    assert!(e.contains(both[0]), "{e}");
    let image = of(&all, DEPTH)[0];
    let e = camera.insert(both[0], Some(&image.schema), &image.data);
    let e = e.expect_err("an image").to_string();
    assert!(e.contains("sensor_msgs/CameraInfo"), "{e}");
    let info = of(&all, both[0])[0];
    for cut in 0..info.data.len() {
        let cut = camera.insert(both[0], None, &info.data[..cut]);
        // The fields after P are not read.
        assert!(cut.is_err() || camera.missing() == both[1..]);
    }
    camera.insert(both[0], None, &info.data).expect("a camera");
    assert_eq!(camera.missing(), both[1..]);
    assert!(!camera.lacks_transform(), "colour is unknown");
    let e = camera.frames().expect_err("colour").to_string();
    assert!(e.contains(both[1]), "{e}");
}

#[test]
fn damaged_and_foreign_messages_are_typed_errors() {
    let all = messages("ros2_sqlite");
    let mut frames = camera(&all, DEPTH, COLOR).frames().expect("calibrated");
    let decode = |frames: &mut LiveFrames, m: LiveMessage<'_>| {
        let image = frames.decoder().image(m)?;
        frames.frame(image, |_, _| Ok(None)).map(drop)
    };
    let depth = of(&all, DEPTH)[0];
    for cut in 0..depth.data.len() {
        let mut m = depth.message();
        m.data = &m.data[..cut];
        let e = decode(&mut frames, m).expect_err("cut").to_string();
        assert!(e.contains(DEPTH), "{e}");
    }
    for at in 0..80 {
        for bit in 0..8 {
            let mut flipped = depth.clone();
            flipped.data[at] ^= 1 << bit;
            let _ = decode(&mut frames, flipped.message());
        }
    }
    let mut tf = of(&all, "/tf_static")[0].message();
    tf.topic = DEPTH;
    let e = decode(&mut frames, tf).expect_err("no image").to_string();
    assert!(
        e.contains("`message 1, /cam/depth/image_raw") && e.contains("sensor_msgs/Image"),
        "{e}"
    );
    let color = of(&all, COLOR)[0];
    let e = decode(&mut frames, color.message()).expect_err("no depth");
    assert!(e.to_string().contains("`bgr8` is no depth"), "{e}");
    let infrared = of(&all, "/cam/infra1/image_raw")[0];
    let e = decode(&mut frames, infrared.message()).expect_err("no depth");
    assert!(e.to_string().contains("`mono8`"), "{e}");
}
