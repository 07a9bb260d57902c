//! Parts of a recording before its frames: time scale, tracks, tags and the attached calibration.

use super::ebml::{ElementHeader, MAX_HEADER, child, children, text, unsigned};
use crate::FormatError;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Identifiers of Matroska elements (RFC 9559).
pub(super) mod id {
    pub(in super::super) const EBML: u32 = 0x1a45_dfa3;
    pub(in super::super) const SEGMENT: u32 = 0x1853_8067;
    pub(in super::super) const CLUSTER: u32 = 0x1f43_b675;
    pub(super) const INFO: u32 = 0x1549_a966;
    pub(super) const TRACKS: u32 = 0x1654_ae6b;
    pub(super) const TAGS: u32 = 0x1254_c367;
    pub(super) const ATTACHMENTS: u32 = 0x1941_a469;
    pub(super) const TIMESTAMP_SCALE: u32 = 0x2a_d7b1;
    pub(super) const TRACK_ENTRY: u32 = 0xae;
    pub(super) const TRACK_NUMBER: u32 = 0xd7;
    pub(super) const DEFAULT_DURATION: u32 = 0x23_e383;
    pub(super) const NAME: u32 = 0x536e;
    pub(super) const CODEC_ID: u32 = 0x86;
    pub(super) const CODEC_PRIVATE: u32 = 0x63a2;
    pub(super) const CONTENT_ENCODINGS: u32 = 0x6d80;
    pub(super) const VIDEO: u32 = 0xe0;
    pub(super) const PIXEL_WIDTH: u32 = 0xb0;
    pub(super) const PIXEL_HEIGHT: u32 = 0xba;
    pub(super) const TAG: u32 = 0x7373;
    pub(super) const SIMPLE_TAG: u32 = 0x67c8;
    pub(super) const TAG_NAME: u32 = 0x45a3;
    pub(super) const TAG_STRING: u32 = 0x4487;
    pub(super) const ATTACHED_FILE: u32 = 0x61a7;
    pub(super) const FILE_NAME: u32 = 0x466e;
    pub(super) const FILE_DATA: u32 = 0x465c;
}

/// Largest part read as a whole, bytes; those of a recorder have 10 kB together.
const MAX_PART: u64 = 16 << 20;

/// Tick of a file that states none, nanoseconds (RFC 9559).
const DEFAULT_TICK_NS: u64 = 1_000_000;

/// Name of the attachment unless a tag states another.
const CALIBRATION_FILE: &str = "calibration.json";

/// A track's description.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct MatroskaTrack {
    /// Number in the blocks.
    pub(super) number: u64,
    /// COLOR, DEPTH, IR, IMU.
    pub(super) name: String,
    /// Four-character code, or the codec's identifier where it has none.
    pub(super) codec: String,
    /// Width, pixels.
    pub(super) width: u32,
    /// Height, pixels.
    pub(super) height: u32,
    /// Frame period, nanoseconds.
    pub(super) period_ns: Option<u64>,
    /// True if the container compresses or encrypts the frames.
    pub(super) is_encoded: bool,
}

/// Everything before the frames.
#[derive(Clone, Debug, Default)]
pub(super) struct MatroskaHeader {
    /// Nanoseconds of a tick.
    pub(super) tick_ns: u64,
    /// Tracks in the file's order.
    pub(super) tracks: Vec<MatroskaTrack>,
    /// Tags by name; the first of a name counts.
    pub(super) tags: BTreeMap<String, String>,
    /// Attached calibration.
    pub(super) calibration: Option<Vec<u8>>,
    /// Position of the first cluster, bytes.
    pub(super) first_cluster: u64,
}

/// Header of the element at `at`; `None` at the end of the file, where it is cut and where none begins.
pub(super) fn element_at(file: &mut File, at: u64) -> std::io::Result<Option<ElementHeader>> {
    file.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::with_capacity(MAX_HEADER);
    file.take(MAX_HEADER as u64).read_to_end(&mut bytes)?;
    Ok(ElementHeader::parse(&bytes))
}

/// Payload of `size` bytes at `at`; shorter where the file ends.
pub(super) fn payload_at(file: &mut File, at: u64, size: u64) -> std::io::Result<Vec<u8>> {
    file.seek(SeekFrom::Start(at))?;
    // The buffer grows as bytes arrive: a stated size alone allocates nothing.
    let mut bytes = Vec::new();
    file.take(size).read_to_end(&mut bytes)?;
    Ok(bytes)
}

impl MatroskaHeader {
    /// Reads the parts, wherever they lie between the clusters.
    ///
    /// # Errors
    /// No Matroska file, no tracks, or no frames.
    pub(super) fn read(path: &Path, file: &mut File) -> Result<Self, FormatError> {
        let io = |e| FormatError::io(path, e);
        let fault = |field: &str, why: &str| FormatError::field(path, field, why);
        let mut parts = BTreeMap::<u32, Vec<u8>>::new();
        let mut first_cluster = None;
        let length = file.metadata().map_err(io)?.len();
        let mut at = 0;
        while at < length {
            let Some(element) = element_at(file, at).map_err(io)? else {
                break;
            };
            if at == 0 && element.id != id::EBML {
                break;
            }
            let payload = at.saturating_add(element.length);
            if matches!(
                element.id,
                id::INFO | id::TRACKS | id::TAGS | id::ATTACHMENTS
            ) {
                let size = element.size.filter(|s| *s <= MAX_PART).ok_or_else(|| {
                    fault(
                        "header",
                        "a part of it is larger than 16 MiB or has no size",
                    )
                })?;
                let bytes = payload_at(file, payload, size).map_err(io)?;
                parts.entry(element.id).or_insert(bytes);
            }
            if element.id == id::CLUSTER {
                first_cluster.get_or_insert(at);
            }
            if parts.len() == 4 && first_cluster.is_some() {
                break;
            }
            at = match (element.id, element.size) {
                (id::SEGMENT, _) | (id::CLUSTER, None) => payload,
                (_, Some(size)) => payload.saturating_add(size),
                (_, None) => break,
            };
        }
        if at == 0 {
            return Err(fault("EBML", "missing: not a Matroska file"));
        }
        let tracks = parts
            .get(&id::TRACKS)
            .ok_or_else(|| fault("Tracks", "missing"))?;
        let info = parts
            .get(&id::INFO)
            .and_then(|i| child(i, id::TIMESTAMP_SCALE));
        let tags = parts.get(&id::TAGS).map_or_else(BTreeMap::new, |t| tags(t));
        let name = tags
            .get("K4A_CALIBRATION_FILE")
            .map_or(CALIBRATION_FILE, String::as_str);
        Ok(Self {
            tick_ns: info.and_then(unsigned).unwrap_or(DEFAULT_TICK_NS),
            tracks: children(tracks)
                .filter(|(i, _)| *i == id::TRACK_ENTRY)
                .filter_map(|(_, entry)| track(entry))
                .collect(),
            calibration: parts
                .get(&id::ATTACHMENTS)
                .and_then(|a| attachment(a, name)),
            tags,
            first_cluster: first_cluster
                .ok_or_else(|| fault("Cluster", "missing: the recording has no frame"))?,
        })
    }
}

/// Track of an entry; `None` without a number.
fn track(entry: &[u8]) -> Option<MatroskaTrack> {
    let number = |of: &[u8], id| child(of, id).and_then(unsigned);
    let video = child(entry, id::VIDEO).unwrap_or_default();
    let side = |id| {
        number(video, id)
            .and_then(|n| u32::try_from(n).ok())
            .unwrap_or(0)
    };
    let codec = child(entry, id::CODEC_ID).map(text).unwrap_or_default();
    Some(MatroskaTrack {
        number: number(entry, id::TRACK_NUMBER).filter(|n| *n > 0)?,
        name: child(entry, id::NAME).map(text).unwrap_or_default(),
        codec: match codec.as_str() {
            "V_MS/VFW/FOURCC" => four_characters(entry).unwrap_or(codec),
            "V_MJPEG" => "MJPG".to_owned(),
            _ => codec,
        },
        width: side(id::PIXEL_WIDTH),
        height: side(id::PIXEL_HEIGHT),
        period_ns: number(entry, id::DEFAULT_DURATION).filter(|p| *p > 0),
        is_encoded: child(entry, id::CONTENT_ENCODINGS).is_some(),
    })
}

/// `biCompression` of the attached `BITMAPINFOHEADER`.
fn four_characters(entry: &[u8]) -> Option<String> {
    let code = child(entry, id::CODEC_PRIVATE)?.get(16..20)?;
    Some(String::from_utf8_lossy(code).into_owned())
}

/// Names and texts of all tags.
fn tags(payload: &[u8]) -> BTreeMap<String, String> {
    let mut out = BTreeMap::new();
    for (_, tag) in children(payload).filter(|(i, _)| *i == id::TAG) {
        for (_, simple) in children(tag).filter(|(i, _)| *i == id::SIMPLE_TAG) {
            let get = |id| child(simple, id).map(text);
            if let (Some(name), Some(value)) = (get(id::TAG_NAME), get(id::TAG_STRING)) {
                out.entry(name).or_insert(value);
            }
        }
    }
    out
}

/// Content of the attached file with this name.
fn attachment(payload: &[u8], name: &str) -> Option<Vec<u8>> {
    let is_named = |file: &&[u8]| child(file, id::FILE_NAME).map(text).as_deref() == Some(name);
    children(payload)
        .filter(|(i, _)| *i == id::ATTACHED_FILE)
        .map(|(_, file)| file)
        .find(is_named)
        .and_then(|file| child(file, id::FILE_DATA))
        .map(<[u8]>::to_vec)
}
