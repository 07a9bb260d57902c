//! Reads RGBD frames from an MCAP file as a stream: memory for one frame, whatever the file's length.

use crate::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};
use crate::formats::foxglove::{
    CameraCalibration, CompressedImage, FoxgloveMessage, FrameTransform, RawImage, decode,
};
use crate::formats::image::{check_size, decode_color};
use crate::formats::{FormatError, RgbdSource};
use crate::math::{Camera, ColorCamera, Rigid};
use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// No record is larger: an uncompressed colour image of 4096 × 4096 has 48 MiB. A length above it is refused before
/// anything is allocated.
const MAX_RECORD: usize = 64 << 20;

/// Colour older than this against its depth shows another pose, nanoseconds: one frame at 30 Hz.
const MAX_GAP_NS: u64 = 33_400_000;

/// Depth images looked at in search of calibrations before a file is said to have none: writers repeat them at
/// least once a second.
const LOOK_AHEAD: usize = 60;

/// What a message is to us.
enum Item {
    Depth {
        frame_id: String,
        sequence: u32,
        time_ns: u64,
        image: DepthImage,
    },
    Color {
        frame_id: String,
        time_ns: u64,
        image: ColorImage,
    },
    Calibration(CameraCalibration),
    Transform(FrameTransform),
}

/// An MCAP recording, read frame by frame. A file that was cut ends at the cut.
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
    cut: bool,
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
    /// Opens a file and finds its calibration.
    ///
    /// # Errors
    /// Not an MCAP file, no 16-bit depth, no calibration for it, or a damaged start.
    pub fn open(path: &Path) -> Result<Self, FormatError> {
        let file = File::open(path).map_err(|e| FormatError::io(path, e))?;
        let mut reader = Self {
            path: path.to_owned(),
            file: BufReader::with_capacity(1 << 16, file),
            records: records(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            calibration: Calibration::registered(Intrinsics::KINECT_V1),
            color: None,
            messages: 0,
            cut: false,
        };
        reader.calibration = reader.find_calibration()?;
        reader.rewind()?;
        Ok(reader)
    }
    /// The file ended in the middle of a record; everything before was read.
    pub fn was_cut(&self) -> bool {
        self.cut
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
                Some(Item::Depth { frame_id, .. }) => {
                    depth.get_or_insert(frame_id);
                    depths += 1;
                }
                Some(Item::Color { frame_id, .. }) => {
                    color.get_or_insert(frame_id);
                }
                Some(Item::Calibration(c)) => {
                    cameras.insert(c.frame_id.clone(), c);
                }
                Some(Item::Transform(t)) => transforms.push(t),
            }
            // Two depth images: one round of all topics has gone by.
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
        let turn = Quaternion::new(q.w, q.x, q.y, q.z);
        let pose = Rigid::from_parts(
            Vector3::new(p.x, p.y, p.z),
            UnitQuaternion::from_quaternion(turn),
        );
        if pose.is_finite() {
            Ok(pose)
        } else {
            Err(self.fault("foxglove.FrameTransform", "not a finite pose"))
        }
    }

    /// The next message that means something to us; `None` at the end or the cut.
    fn next_item(&mut self) -> Result<Option<Item>, FormatError> {
        loop {
            let Some(event) = self.records.next_event() else {
                return Ok(None);
            };
            match event {
                Ok(LinearReadEvent::ReadRequest(n)) => {
                    // At most a buffer at a time: a lying length then costs what the file holds, not what it claims.
                    let want = self.records.insert(n.min(1 << 16));
                    let got = self
                        .file
                        .read(want)
                        .map_err(|e| FormatError::io(&self.path, e))?;
                    self.records.notify_read(got);
                }
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    let record = mcap::parse_record(opcode, data).map_err(|e| {
                        FormatError::field(
                            &self.path,
                            format!("record 0x{opcode:02x}"),
                            e.to_string(),
                        )
                    })?;
                    match record {
                        Record::Schema { header, .. } => {
                            self.schemas.insert(header.id, header.name);
                        }
                        Record::Channel(c) => {
                            let schema =
                                self.schemas.get(&c.schema_id).cloned().unwrap_or_default();
                            self.channels.insert(c.id, schema);
                        }
                        Record::Message { header, data } => {
                            self.messages += 1;
                            let schema = self
                                .channels
                                .get(&header.channel_id)
                                .map_or("", String::as_str);
                            let at = Place {
                                path: &self.path,
                                schema,
                                message: self.messages,
                            };
                            if let Some(item) = at.item(header.sequence, header.log_time, &data)? {
                                return Ok(Some(item));
                            }
                        }
                        _ => {}
                    }
                }
                Err(McapError::UnexpectedEof | McapError::UnexpectedEoc) if self.messages > 0 => {
                    self.cut = true;
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

/// A message and where it stands, for errors.
struct Place<'a> {
    path: &'a Path,
    schema: &'a str,
    message: u64,
}

impl Place<'_> {
    fn fault(&self, field: &str, why: impl Into<String>) -> FormatError {
        FormatError::field(
            self.path,
            format!("message {} ({}).{field}", self.message, self.schema),
            why,
        )
    }
    fn message<M: FoxgloveMessage>(&self, data: &[u8]) -> Result<M, FormatError> {
        decode(data).ok_or_else(|| self.fault("data", "not a message of this schema"))
    }

    fn item(&self, sequence: u32, time_ns: u64, data: &[u8]) -> Result<Option<Item>, FormatError> {
        Ok(match self.schema {
            "foxglove.RawImage" => {
                let m: RawImage = self.message(data)?;
                match m.encoding.as_str() {
                    "16UC1" | "mono16" => {
                        let rows = self.rows(&m, 2)?;
                        let values = rows
                            .flat_map(|r| {
                                r.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]]))
                            })
                            .collect();
                        let image = DepthImage::new(m.width, m.height, values)
                            .map_err(|e| self.fault("data", e.to_string()))?;
                        Some(Item::Depth {
                            frame_id: m.frame_id.clone(),
                            sequence,
                            time_ns,
                            image,
                        })
                    }
                    "rgb8" => {
                        let bytes = self.rows(&m, 3)?.flatten().copied().collect();
                        let image = ColorImage::new(m.width, m.height, bytes)
                            .map_err(|e| self.fault("data", e.to_string()))?;
                        Some(Item::Color {
                            frame_id: m.frame_id.clone(),
                            time_ns,
                            image,
                        })
                    }
                    _ => None,
                }
            }
            "foxglove.CompressedImage" => {
                let m: CompressedImage = self.message(data)?;
                if !matches!(m.format.as_str(), "jpeg" | "png") {
                    return Ok(None);
                }
                let image = decode_color(&m.data, self.path)
                    .map_err(|e| self.fault("data", e.to_string()))?;
                Some(Item::Color {
                    frame_id: m.frame_id,
                    time_ns,
                    image,
                })
            }
            "foxglove.CameraCalibration" => Some(Item::Calibration(self.message(data)?)),
            "foxglove.FrameTransform" => Some(Item::Transform(self.message(data)?)),
            _ => None,
        })
    }

    /// The pixels of each row, checked against size and step.
    fn rows<'m>(
        &self,
        m: &'m RawImage,
        bytes: usize,
    ) -> Result<impl Iterator<Item = &'m [u8]>, FormatError> {
        check_size(self.path, m.width, m.height)?;
        let (row, step) = (m.width as usize * bytes, m.step as usize);
        if step < row {
            return Err(self.fault("step", format!("{step}, a row has {row} bytes")));
        }
        let need = step * (m.height as usize - 1) + row;
        if m.data.len() < need {
            return Err(self.fault("data", format!("{} bytes, expected {need}", m.data.len())));
        }
        Ok(m.data
            .chunks(step)
            .take(m.height as usize)
            .map(move |r| &r[..row]))
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
                Item::Color { time_ns, image, .. } => self.color = Some((time_ns, image)),
                Item::Depth {
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
                Item::Calibration(_) | Item::Transform(_) => {}
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
        (self.color, self.messages, self.cut) = (None, 0, false);
        Ok(())
    }
}
