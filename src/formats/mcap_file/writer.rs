//! Streams frames into an MCAP file.

use crate::foxglove::{
    CameraCalibration, CompressedImage, FrameTransform, Quaternion, RawImage, Vector3, encode,
    schema, timestamp,
};
use crate::{FormatError, image, private_file};
use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{Calibration, Intrinsics, RgbdFrame};

/// JPEG quality of colour: 35 kB a VGA image.
const JPEG_QUALITY: u8 = 85;

const DEPTH: &str = "/camera/depth";
const COLOR: &str = "/camera/color";
/// Calibrations have a topic for each camera: viewers show the last message of a topic.
const DEPTH_CALIBRATION: &str = "/camera/depth/calibration";
/// See [`DEPTH_CALIBRATION`].
const COLOR_CALIBRATION: &str = "/camera/color/calibration";
const TRANSFORM: &str = "/tf";

/// Frame of reference of the depth camera, and of colour registered to it.
const DEPTH_FRAME: &str = "depth_camera";
/// Frame of reference of a separate colour camera.
const COLOR_FRAME: &str = "color_camera";

/// Channel numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Channels {
    pub(super) depth: u16,
    color: u16,
    depth_calibration: u16,
    color_calibration: u16,
    transform: u16,
}

impl Channels {
    /// Channel of a topic.
    pub(super) fn of(&self, topic: &str) -> Option<u16> {
        match topic {
            DEPTH => Some(self.depth),
            COLOR => Some(self.color),
            DEPTH_CALIBRATION => Some(self.depth_calibration),
            COLOR_CALIBRATION => Some(self.color_calibration),
            TRANSFORM => Some(self.transform),
            _ => None,
        }
    }
}

/// An MCAP recording being written. Every frame is flushed when [`McapWriter::write`] returns;
/// [`McapWriter::finish`] adds the index.
pub struct McapWriter {
    path: PathBuf,
    writer: Writer<BufWriter<File>>,
    pub(super) channels: Channels,
    calibration: Calibration,
    pub(super) frames: u32,
}

/// Error of the system, such as a full disk, or of the format.
fn fault(path: &Path, field: &str, e: McapError) -> FormatError {
    match e {
        McapError::Io(e) => FormatError::io(path, e),
        other => FormatError::field(path, field, other.to_string()),
    }
}

impl std::fmt::Debug for McapWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("McapWriter")
            .field("path", &self.path)
            .field("frames", &self.frames)
            .finish()
    }
}

impl McapWriter {
    /// Creates the file, for its owner to read; an existing one is not overwritten.
    ///
    /// # Errors
    /// When it exists or cannot be created.
    pub fn create(path: &Path, calibration: &Calibration) -> Result<Self, FormatError> {
        let fault = |e| fault(path, "mcap", e);
        let file = private_file::create_new(path).map_err(|e| FormatError::io(path, e))?;
        // lz4 compresses raw depth to a third in about 1 ms; JPEG costs next to nothing.
        let options = WriteOptions::new()
            .compression(Some(Compression::Lz4))
            .library(concat!("tryon ", env!("CARGO_PKG_VERSION")))
            .profile("");
        let mut writer = options.create(BufWriter::new(file)).map_err(fault)?;
        let mut channel = |topic: &str, message: &str| {
            let id =
                writer.add_schema(&format!("foxglove.{message}"), "protobuf", &schema(message))?;
            writer.add_channel(id, topic, "protobuf", &BTreeMap::new())
        };
        let channels = Channels {
            depth: channel(DEPTH, "RawImage").map_err(fault)?,
            color: channel(COLOR, "CompressedImage").map_err(fault)?,
            depth_calibration: channel(DEPTH_CALIBRATION, "CameraCalibration").map_err(fault)?,
            color_calibration: channel(COLOR_CALIBRATION, "CameraCalibration").map_err(fault)?,
            transform: channel(TRANSFORM, "FrameTransform").map_err(fault)?,
        };
        Ok(Self {
            path: path.to_owned(),
            writer,
            channels,
            calibration: calibration.clone(),
            frames: 0,
        })
    }
    /// Frames written so far.
    pub fn frames(&self) -> usize {
        self.frames as usize
    }

    /// Writes a message.
    pub(super) fn put(
        &mut self,
        channel: u16,
        sequence: u32,
        time_ns: u64,
        data: &[u8],
    ) -> Result<(), FormatError> {
        let header = MessageHeader {
            channel_id: channel,
            sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.writer
            .write_to_known_channel(&header, data)
            .map_err(|e| fault(&self.path, &format!("frame {sequence}"), e))
    }

    fn put_calibration(&mut self, time_ns: u64) -> Result<(), FormatError> {
        let message = |k: &Intrinsics, frame: &str| CameraCalibration {
            timestamp: timestamp(time_ns),
            width: k.width,
            height: k.height,
            distortion_model: "plumb_bob".into(),
            d: vec![0.0; 5],
            k: vec![k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0],
            r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p: vec![
                k.fx, 0.0, k.cx, 0.0, 0.0, k.fy, k.cy, 0.0, 0.0, 0.0, 1.0, 0.0,
            ],
            frame_id: frame.into(),
        };
        let depth = encode(&message(&self.calibration.depth, DEPTH_FRAME));
        self.put(self.channels.depth_calibration, 0, time_ns, &depth)?;
        if let Some(k) = self.calibration.color {
            self.put(
                self.channels.color_calibration,
                0,
                time_ns,
                &encode(&message(&k, COLOR_FRAME)),
            )?;
            let pose = self.calibration.color_from_depth.inverse();
            let (t, q) = (pose.iso().translation.vector, pose.iso().rotation.coords);
            let transform = FrameTransform {
                timestamp: timestamp(time_ns),
                parent_frame_id: DEPTH_FRAME.into(),
                child_frame_id: COLOR_FRAME.into(),
                translation: Some(Vector3 {
                    x: t.x,
                    y: t.y,
                    z: t.z,
                }),
                rotation: Some(Quaternion {
                    x: q.x,
                    y: q.y,
                    z: q.z,
                    w: q.w,
                }),
            };
            self.put(self.channels.transform, 0, time_ns, &encode(&transform))?;
        }
        Ok(())
    }

    /// Appends a frame.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&mut self, frame: &RgbdFrame) -> Result<(), FormatError> {
        if self.frames == 0 {
            self.put_calibration(frame.time_ns)?;
        }
        let sequence = frame.sequence as u32;
        if let Some(color) = &frame.color {
            let message = CompressedImage {
                timestamp: timestamp(frame.time_ns),
                data: image::encode_jpeg(color, JPEG_QUALITY)?,
                format: "jpeg".into(),
                frame_id: if self.calibration.color.is_some() {
                    COLOR_FRAME
                } else {
                    DEPTH_FRAME
                }
                .into(),
            };
            self.put(
                self.channels.color,
                sequence,
                frame.time_ns,
                &encode(&message),
            )?;
        }
        let depth = &frame.depth;
        let message = RawImage {
            timestamp: timestamp(frame.time_ns),
            width: depth.width(),
            height: depth.height(),
            encoding: "16UC1".into(),
            step: 2 * depth.width(),
            data: depth.data().iter().flat_map(|d| d.to_le_bytes()).collect(),
            frame_id: DEPTH_FRAME.into(),
        };
        // Depth last: it completes the frame for a reader.
        self.put(
            self.channels.depth,
            sequence,
            frame.time_ns,
            &encode(&message),
        )?;
        self.end_frame()
    }

    /// Counts a frame and ends its chunk.
    pub(super) fn end_frame(&mut self) -> Result<(), FormatError> {
        self.frames += 1;
        self.writer
            .flush()
            .map_err(|e| fault(&self.path, "mcap", e))
    }
    /// Writes the index and closes the file.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn finish(mut self) -> Result<(), FormatError> {
        self.writer
            .finish()
            .map(|_| ())
            .map_err(|e| fault(&self.path, "mcap", e))
    }
}
