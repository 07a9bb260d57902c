//! Reads RGBD frames from an MCAP file as a stream, with memory for one frame.

use super::message::{MessageContext, MessageItem};
use super::record::McapRecord;
use crate::FormatError;
use crate::foxglove::{CameraCalibration, FrameTransform};
use crate::rgbd_source::RgbdSource;
use mcap::McapError;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{Calibration, ColorImage, Intrinsics, RgbdFrame};
use tryon_geometry::math::{Camera, ColorCamera, Rigid};

/// Largest record, bytes: an uncompressed colour image of 4096 × 4096 has 48 MiB. A greater length is refused before
/// anything is allocated.
const MAX_RECORD: usize = 64 << 20;

/// Largest time between colour and its depth, nanoseconds: one frame at 30 Hz. Older colour shows another pose.
const MAX_GAP_NS: u64 = 33_400_000;

/// Depth images searched for calibrations: writers repeat them at least once a second.
const LOOK_AHEAD: usize = 60;

/// Read buffer, bytes.
const BUFFER: usize = 1 << 16;

/// An MCAP recording, read frame by frame. A truncated file ends at the last whole record.
pub struct McapReader {
    path: PathBuf,
    file: BufReader<File>,
    records: LinearReader,
    /// Names of schemas by number, and of channels' schemas by channel.
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, String>,
    calibration: Calibration,
    color: Option<(u64, ColorImage)>,
    messages: u64,
}

impl std::fmt::Debug for McapReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("McapReader")
            .field("path", &self.path)
            .field("messages", &self.messages)
            .finish()
    }
}

fn records() -> LinearReader {
    LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_record_length_limit(MAX_RECORD)
            .with_validate_chunk_crcs(true),
    )
}

impl McapReader {
    /// Opens a file and reads its calibration.
    ///
    /// # Errors
    /// Not an MCAP file, no 16-bit depth, no calibration for it, or a damaged start.
    pub fn open(path: &Path) -> Result<Self, FormatError> {
        let file = File::open(path).map_err(|e| FormatError::io(path, e))?;
        let mut reader = Self {
            path: path.to_owned(),
            file: BufReader::with_capacity(BUFFER, file),
            records: records(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            calibration: Calibration::registered(Intrinsics::KINECT_V1),
            color: None,
            messages: 0,
        };
        reader.calibration = reader.find_calibration()?;
        reader.rewind()?;
        Ok(reader)
    }

    fn fault(&self, field: impl Into<String>, why: impl Into<String>) -> FormatError {
        FormatError::field(&self.path, field, why)
    }

    fn find_calibration(&mut self) -> Result<Calibration, FormatError> {
        let (mut cameras, mut transforms) = (BTreeMap::new(), Vec::new());
        let (mut depth, mut color) = (None, None);
        let mut depths = 0;
        while depths < LOOK_AHEAD {
            match self.next_item()? {
                None => break,
                Some(MessageItem::Depth { frame_id, .. }) => {
                    depth.get_or_insert(frame_id);
                    depths += 1;
                }
                Some(MessageItem::Color { frame_id, .. }) => {
                    color.get_or_insert(frame_id);
                }
                Some(MessageItem::Calibration(c)) => {
                    cameras.insert(c.frame_id.clone(), c);
                }
                Some(MessageItem::Transform(t)) => transforms.push(t),
            }
            // Two depth images: every topic has had a message.
            let known =
                |frame: &Option<String>| frame.as_ref().is_none_or(|f| cameras.contains_key(f));
            if depths >= 2 && known(&depth) && known(&color) {
                break;
            }
        }
        let Some(depth) = depth else {
            return Err(self.fault(
                "foxglove.RawImage",
                "no depth image (encoding 16UC1 or mono16)",
            ));
        };
        let Some(camera) = cameras.get(&depth) else {
            return Err(self.fault(
                "foxglove.CameraCalibration",
                format!("none for frame_id `{depth}`"),
            ));
        };
        let depth_camera = self.intrinsics(camera)?;
        let separate = color
            .filter(|c| *c != depth)
            .and_then(|c| cameras.get(&c).map(|k| (c, k)));
        let Some((color, camera)) = separate else {
            return Ok(Calibration::registered(depth_camera));
        };
        let color_camera = self.intrinsics(camera)?;
        let mut color_from_depth = Rigid::identity();
        for t in &transforms {
            let forward = t.parent_frame_id == depth && t.child_frame_id == color;
            if forward || (t.parent_frame_id == color && t.child_frame_id == depth) {
                let pose: Rigid<Camera, ColorCamera> = self.pose(t)?;
                color_from_depth = if forward {
                    pose.inverse()
                } else {
                    Rigid::new(*pose.iso())
                };
            }
        }
        Ok(Calibration {
            depth: depth_camera,
            color: Some(color_camera),
            color_from_depth,
        })
    }

    fn intrinsics(&self, c: &CameraCalibration) -> Result<Intrinsics, FormatError> {
        let field = |name: &str| format!("foxglove.CameraCalibration({}).{name}", c.frame_id);
        let [fx, _, cx, _, fy, cy, ..] = c.k[..] else {
            return Err(self.fault(field("K"), format!("{} values, expected 9", c.k.len())));
        };
        let k = Intrinsics {
            width: c.width,
            height: c.height,
            fx,
            fy,
            cx,
            cy,
        };
        k.validated()
            .map_err(|e| self.fault(field(e.field), format!("{}, expected {}", e.value, e.why)))
    }

    fn pose(&self, t: &FrameTransform) -> Result<Rigid<Camera, ColorCamera>, FormatError> {
        let (Some(p), Some(q)) = (t.translation, t.rotation) else {
            return Ok(Rigid::identity());
        };
        let rotation = Quaternion::new(q.w, q.x, q.y, q.z);
        let pose = Rigid::from_parts(
            Vector3::new(p.x, p.y, p.z),
            UnitQuaternion::from_quaternion(rotation),
        );
        if pose.is_finite() {
            Ok(pose)
        } else {
            Err(self.fault("foxglove.FrameTransform", "not a finite pose"))
        }
    }

    /// Next message of interest; `None` at the end, also of a truncated file.
    fn next_item(&mut self) -> Result<Option<MessageItem>, FormatError> {
        loop {
            let Some(event) = self.records.next_event() else {
                return Ok(None);
            };
            match event {
                Ok(LinearReadEvent::ReadRequest(n)) => {
                    // At most a buffer at a time: a wrong length costs no more memory than the file holds.
                    let want = self.records.insert(n.min(BUFFER));
                    let got = self
                        .file
                        .read(want)
                        .map_err(|e| FormatError::io(&self.path, e))?;
                    self.records.notify_read(got);
                }
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    let record = McapRecord::parse(opcode, data).map_err(|part| {
                        let field = format!("record 0x{opcode:02x}.{part}");
                        FormatError::field(&self.path, field, "cut short, or no text")
                    })?;
                    match record {
                        Some(McapRecord::Schema { id, name }) => {
                            self.schemas.insert(id, name.to_owned());
                        }
                        Some(McapRecord::Channel { id, schema }) => {
                            let name = self.schemas.get(&schema).cloned().unwrap_or_default();
                            self.channels.insert(id, name);
                        }
                        Some(McapRecord::Message {
                            channel,
                            sequence,
                            log_time,
                            data,
                        }) => {
                            self.messages += 1;
                            let schema = self.channels.get(&channel).map_or("", String::as_str);
                            let at = MessageContext {
                                path: &self.path,
                                schema,
                                message: self.messages,
                            };
                            if let Some(item) = at.item(sequence, log_time, data)? {
                                return Ok(Some(item));
                            }
                        }
                        None => {}
                    }
                }
                Err(McapError::UnexpectedEof | McapError::UnexpectedEoc) if self.messages > 0 => {
                    return Ok(None);
                }
                Err(e) => {
                    let why = e.to_string();
                    return Err(self.fault(format!("after message {}", self.messages), why));
                }
            }
        }
    }
}

impl RgbdSource for McapReader {
    fn calibration(&self) -> &Calibration {
        &self.calibration
    }
    fn len(&self) -> Option<usize> {
        None
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        while let Some(item) = self.next_item()? {
            match item {
                MessageItem::Color { time_ns, image, .. } => self.color = Some((time_ns, image)),
                MessageItem::Depth {
                    sequence,
                    time_ns,
                    image,
                    ..
                } => {
                    let want = &self.calibration.depth;
                    if (image.width(), image.height()) != (want.width, want.height) {
                        let why = format!(
                            "{}×{}, but the calibration says {}×{}",
                            image.width(),
                            image.height(),
                            want.width,
                            want.height
                        );
                        return Err(
                            self.fault(format!("message {}: depth size", self.messages), why)
                        );
                    }
                    let color = self
                        .color
                        .take_if(|(t, _)| t.abs_diff(time_ns) <= MAX_GAP_NS)
                        .map(|(_, c)| c);
                    return Ok(Some(RgbdFrame {
                        sequence: sequence.into(),
                        time_ns,
                        depth: image,
                        color,
                    }));
                }
                MessageItem::Calibration(_) | MessageItem::Transform(_) => {}
            }
        }
        Ok(None)
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.file
            .seek(SeekFrom::Start(0))
            .map_err(|e| FormatError::io(&self.path, e))?;
        self.records = records();
        self.schemas.clear();
        self.channels.clear();
        (self.color, self.messages) = (None, 0);
        Ok(())
    }
}
