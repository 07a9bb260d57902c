//! Recordings: MCAP files, ROS bags, rosbag2 databases and RGBD folders.

use super::{Target, packed, text};
use crate::bundle::Bundle;
use crate::pack;
use std::path::Path;
use tryon::formats::{McapWriter, RgbdFolderWriter, open_recording};
use tryon::geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};

/// Most frames read from an input.
const MOST_FRAMES: usize = 50;

/// MCAP: messages packed anew, or a raw file.
pub(super) const MCAP: Target = Target::new(
    "mcap",
    "src/formats/mcap_file",
    |b, scratch| {
        let file = packed(b, "a.mcap", || pack::mcap(&b.0))?;
        frames(&scratch.file("a.mcap", &file)?)
    },
    || {
        let file = recorded(|path, calibration, frames| {
            let mut writer = McapWriter::create(path, calibration).map_err(text)?;
            for f in frames {
                writer.write(f).map_err(text)?;
            }
            writer.finish().map(drop).map_err(text)
        });
        let raw = file.0.first().map_or_else(Vec::new, |m| m.bytes.clone());
        let messages = pack::unpack_mcap(&raw).unwrap_or_default();
        let others = [
            &include_bytes!("../../../../src/formats/testdata/recordings/compressed_ros1.mcap")[..],
            include_bytes!("../../../../src/formats/testdata/recordings/compressed_ros2.mcap"),
        ];
        let mut seeds = vec![Bundle::of("a.mcap", raw), messages];
        seeds.extend(others.map(|file| Bundle::of("a.mcap", file)));
        seeds
    },
)
.words("16UC1 mono16 rgb8 jpeg png depth_camera color_camera")
.allow(2 << 20, 60_000);

/// ROS bags, as raw files.
pub(super) const BAG: Target = Target::new(
    "bag",
    "src/formats/bag_file",
    |b, scratch| frames(&scratch.file("a.bag", b.first())?),
    || {
        let files = [
            &include_bytes!("../../../../src/formats/testdata/recordings/ros1_bz2.bag")[..],
            include_bytes!("../../../../src/formats/testdata/recordings/ros1_lz4.bag"),
        ];
        files.map(|file| Bundle::of("a.bag", file)).to_vec()
    },
)
.words("op= conn= topic= type= compression= size= none bz2 lz4 16UC1 bgr8 sensor_msgs/Image")
.allow(2 << 20, 60_000);

/// rosbag2 databases, as raw files.
pub(super) const SQLITE: Target = Target {
    longest: 64 << 10,
    ..Target::new(
        "rosbag2",
        "src/formats/rosbag2",
        |b, scratch| frames(&scratch.file("a.db3", b.first())?),
        || {
            let file = include_bytes!(
                "../../../../src/formats/testdata/recordings/ros2_sqlite/ros2_sqlite.db3"
            );
            vec![Bundle::of("a.db3", *file)]
        },
    )
    .words("messages topics topic_id timestamp data cdr 16UC1 bgr8 sensor_msgs/msg/Image")
    .allow(2 << 20, 60_000)
};

/// RGBD folders.
pub(super) const FOLDER: Target = Target::new(
    "rgbd-folder",
    "src/formats/rgbd_folder",
    |b, scratch| frames(scratch.fill(b)?),
    || {
        let folder = recorded(|path, calibration, frames| {
            let mut writer = RgbdFolderWriter::create(path, calibration).map_err(text)?;
            for f in frames {
                writer.write(f).map_err(text)?;
            }
            Ok(())
        });
        vec![folder]
    },
)
.words("width height fx cx depth_scale color color_from_depth color_time_offset_s translation rotation ..")
.allow(1 << 20, 60_000);

/// Reads the first frames of a recording; the count of their pixels.
pub(super) fn frames(path: &Path) -> Result<usize, String> {
    let mut source = open_recording(path).map_err(text)?;
    let mut pixels = 0;
    for _ in 0..MOST_FRAMES {
        match source.next_frame().map_err(text)? {
            Some(f) => pixels += f.depth.data().len(),
            None => break,
        }
    }
    source.rewind().map_err(text)?;
    Ok(pixels)
}

/// Files that `write` makes of three frames of 8 × 6 pixels with a colour camera of its own.
fn recorded(write: impl Fn(&Path, &Calibration, &[RgbdFrame]) -> Result<(), String>) -> Bundle {
    let depth_camera = Intrinsics::KINECT_V1.resized(8, 6);
    let calibration = Calibration {
        color: Some(Intrinsics::KINECT_V1.resized(16, 12)),
        ..Calibration::registered(depth_camera)
    };
    let frame = |i: u64| RgbdFrame {
        sequence: i,
        time_ns: i * 33_000_000,
        depth: DepthImage::new(8, 6, vec![1000 + i as u16; 48]).unwrap_or(DepthImage::empty(8, 6)),
        color: Some(ColorImage::filled(16, 12, [i as u8; 3])),
    };
    let frames: Vec<RgbdFrame> = (0..3).map(frame).collect();
    let read = || {
        let folder = tempfile::tempdir().ok()?;
        let path = folder.path().join("recording.mcap");
        write(&path, &calibration, &frames).ok()?;
        Bundle::read(&path).ok()
    };
    read().unwrap_or_default()
}
