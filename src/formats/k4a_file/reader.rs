//! Azure Kinect recordings, read frame by frame with memory for one frame.

use super::blocks::{BlockLocation, BlockScanner};
use super::calibration::lenses;
use super::header::{MatroskaHeader, MatroskaTrack};
use super::pairs::{FramePair, PairTiming, PendingFrames};
use super::pixels::{ColorCodec, DepthCodec};
use crate::FormatError;
use crate::image::check_size;
use crate::rgbd_folder::read_lenses;
use crate::rgbd_source::RgbdSource;
use std::fs::File;
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, LensCalibration, RgbdFrame};

/// Period of a track that states none, nanoseconds: 30 Hz.
const DEFAULT_PERIOD_NS: u64 = 33_333_333;

/// A track that frames are read from.
#[derive(Clone, Copy, Debug)]
struct VideoTrack<C> {
    number: u64,
    size: (u32, u32),
    codec: C,
}

/// An Azure Kinect recording. Frames are as recorded, distortion included.
#[derive(Debug)]
pub struct K4aReader {
    path: PathBuf,
    scanner: BlockScanner,
    calibration: Calibration,
    lenses: LensCalibration,
    untaken: Vec<String>,
    depth: VideoTrack<DepthCodec>,
    color: Option<VideoTrack<ColorCodec>>,
    timing: PairTiming,
    /// Device time of the first timestamp, nanoseconds.
    start_ns: u64,
    pending: PendingFrames,
    next: u64,
}

impl K4aReader {
    /// Reads tracks, tags and calibration; frames are read one by one.
    ///
    /// # Errors
    /// No Matroska file, no recording of an Azure Kinect, or an unusable calibration.
    pub fn open(path: &Path) -> Result<Self, FormatError> {
        Self::open_with(path, None)
    }

    /// As [`K4aReader::open`], with a `camera.json` for a recording without its calibration.
    ///
    /// # Errors
    /// As [`K4aReader::open`], and a camera of other sizes than the tracks.
    pub fn open_with(path: &Path, camera: Option<&Path>) -> Result<Self, FormatError> {
        let mut file = File::open(path).map_err(|e| FormatError::io(path, e))?;
        let header = MatroskaHeader::read(path, &mut file)?;
        let mut untaken = Vec::new();
        let depth_track = find_depth(path, &header)?;
        let depth = depth(path, depth_track)?;
        let color = color(path, &header, &mut untaken)?;
        let color_size = color.map(|c| c.size);
        let lenses = match (header.calibration.as_deref(), camera) {
            (Some(json), _) => lenses(path, json, depth.size, color_size)?,
            (None, Some(camera)) => {
                let lenses = read_lenses(camera, &mut untaken)?;
                let camera = (camera, &lenses);
                check_sizes(path, camera, depth.size, color_size)?;
                lenses
            }
            (None, None) => {
                let why = "missing: recorded without the device's calibration; pass `--camera camera.json`";
                return Err(FormatError::field(path, "calibration.json", why));
            }
        };
        if let Some(camera) = camera.filter(|_| header.calibration.is_some()) {
            let name = camera.display();
            untaken.push(format!("{name}: the recording has its own calibration"));
        }
        untaken.extend(other_tracks(&header, depth.number));
        let timing = PairTiming {
            period_ns: depth_track.period_ns.unwrap_or(DEFAULT_PERIOD_NS),
            depth_delay_ns: tag(path, &header, "K4A_DEPTH_DELAY_NS")?,
        };
        let start_ns = tag::<u64>(path, &header, "K4A_START_OFFSET_NS")?;
        Ok(Self {
            path: path.to_owned(),
            scanner: BlockScanner::new(path, file, &header)?,
            calibration: lenses.pinholes(),
            lenses,
            untaken,
            depth,
            color,
            timing,
            start_ns,
            pending: PendingFrames::new(timing),
            next: 0,
        })
    }

    /// The next depth frame and its colour; `None` at the end.
    fn next_pair(&mut self) -> Result<Option<FramePair>, FormatError> {
        let has_color = self.color.is_some();
        while !self.pending.is_decided() {
            let Some(block) = self.scanner.next_block()? else {
                break;
            };
            if block.track == self.depth.number {
                self.pending.push_depth(block);
                if !has_color {
                    break;
                }
            } else if self.color.is_some_and(|c| c.number == block.track) {
                self.pending.push_color(block);
            }
        }
        Ok(self.pending.pop())
    }

    fn read_depth(&mut self, block: &BlockLocation) -> Result<DepthImage, FormatError> {
        let VideoTrack { size, codec, .. } = self.depth;
        let most = 2 * u64::from(size.0) * u64::from(size.1);
        let bytes = self.read(block, most, "DEPTH")?;
        codec
            .decode(&bytes, size)
            .map_err(|why| self.fault("DEPTH", &why))
    }

    fn read_color(&mut self, block: &BlockLocation) -> Result<Option<ColorImage>, FormatError> {
        let Some(VideoTrack { size, codec, .. }) = self.color else {
            return Ok(None);
        };
        let most = 4 * u64::from(size.0) * u64::from(size.1);
        let bytes = self.read(block, most, "COLOR")?;
        let image = codec.decode(&bytes, size);
        image.map(Some).map_err(|why| self.fault("COLOR", &why))
    }

    /// Bytes of a frame of at most `most` bytes.
    fn read(
        &mut self,
        block: &BlockLocation,
        most: u64,
        track: &str,
    ) -> Result<Vec<u8>, FormatError> {
        if block.size > most {
            return Err(self.fault(track, &format!("{} bytes, at most {most}", block.size)));
        }
        self.scanner.read(block)
    }

    fn fault(&self, track: &str, why: &str) -> FormatError {
        let frame = self.next.saturating_sub(1);
        FormatError::field(&self.path, format!("{track}, frame {frame}"), why)
    }
}

/// Checks that the lenses of a `camera.json` have the sizes of the tracks.
fn check_sizes(
    path: &Path,
    (camera, lenses): (&Path, &LensCalibration),
    depth: (u32, u32),
    color: Option<(u32, u32)>,
) -> Result<(), FormatError> {
    let calibration = lenses.pinholes();
    let color_camera = calibration.color.unwrap_or(calibration.depth);
    let tracks = [
        ("DEPTH", Some(depth), calibration.depth),
        ("COLOR", color, color_camera),
    ];
    for (track, size, k) in tracks {
        if let Some((w, h)) = size.filter(|s| *s != (k.width, k.height)) {
            let why = format!(
                "{w}×{h}, but {} says {}×{}",
                camera.display(),
                k.width,
                k.height
            );
            return Err(FormatError::field(path, track, why));
        }
    }
    Ok(())
}

/// The track named DEPTH.
fn find_depth<'a>(
    path: &Path,
    header: &'a MatroskaHeader,
) -> Result<&'a MatroskaTrack, FormatError> {
    let found = header.tracks.iter().find(|t| t.name == "DEPTH");
    found.ok_or_else(|| {
        let names: Vec<&str> = header.tracks.iter().map(|t| t.name.as_str()).collect();
        let is_kinect = names.iter().any(|n| ["COLOR", "IR", "IMU"].contains(n));
        let why = if is_kinect {
            format!("no DEPTH among {names:?}: recorded with depth switched off")
        } else {
            format!("no DEPTH among {names:?}: not a recording of an Azure Kinect")
        };
        FormatError::field(path, "tracks", why)
    })
}

fn depth(path: &Path, track: &MatroskaTrack) -> Result<VideoTrack<DepthCodec>, FormatError> {
    let codec = DepthCodec::of(&track.codec).filter(|_| !track.is_encoded);
    let codec = codec.ok_or_else(|| {
        let why = format!(
            "codec {}, expected b16g as the recorder writes it",
            codec_name(track)
        );
        FormatError::field(path, "DEPTH", why)
    })?;
    check_size(path, track.width, track.height)?;
    Ok(VideoTrack {
        number: track.number,
        size: (track.width, track.height),
        codec,
    })
}

/// The track named COLOR; one that cannot be decoded is noted in `untaken`.
fn color(
    path: &Path,
    header: &MatroskaHeader,
    untaken: &mut Vec<String>,
) -> Result<Option<VideoTrack<ColorCodec>>, FormatError> {
    let Some(track) = header.tracks.iter().find(|t| t.name == "COLOR") else {
        return Ok(None);
    };
    let Some(codec) = ColorCodec::of(&track.codec).filter(|_| !track.is_encoded) else {
        untaken.push(format!("COLOR: codec {} is not decoded", codec_name(track)));
        return Ok(None);
    };
    check_size(path, track.width, track.height)?;
    Ok(Some(VideoTrack {
        number: track.number,
        size: (track.width, track.height),
        codec,
    }))
}

fn codec_name(track: &MatroskaTrack) -> String {
    let suffix = if track.is_encoded {
        ", compressed by the container"
    } else {
        ""
    };
    format!("{}{suffix}", track.codec)
}

/// Notes on the tracks beside depth and colour.
fn other_tracks(header: &MatroskaHeader, depth: u64) -> impl Iterator<Item = String> {
    let others = header
        .tracks
        .iter()
        .filter(move |t| t.number != depth && t.name != "COLOR");
    others.map(|t| match t.name.as_str() {
        "IR" | "DEPTH_IR" => format!("{}: infrared is not used", t.name),
        "IMU" => "IMU: motion of the camera is not used".to_owned(),
        name => format!("{name}: no track of the recorder's own"),
    })
}

/// Whole number of a tag; 0 without it.
fn tag<T: std::str::FromStr + Default>(
    path: &Path,
    header: &MatroskaHeader,
    name: &str,
) -> Result<T, FormatError> {
    let Some(text) = header.tags.get(name) else {
        return Ok(T::default());
    };
    let why = || format!("`{text}`, expected whole nanoseconds");
    text.trim()
        .parse()
        .map_err(|_| FormatError::field(path, name, why()))
}

impl RgbdSource for K4aReader {
    fn calibration(&self) -> &Calibration {
        &self.calibration
    }
    fn lenses(&self) -> LensCalibration {
        self.lenses.clone()
    }
    fn untaken(&self) -> &[String] {
        &self.untaken
    }
    fn len(&self) -> Option<usize> {
        None
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let Some(pair) = self.next_pair()? else {
            return Ok(None);
        };
        let sequence = self.next;
        self.next += 1;
        let depth = self.read_depth(&pair.depth)?;
        let color = match &pair.color {
            None => None,
            Some(block) => self.read_color(block)?,
        };
        Ok(Some(RgbdFrame {
            sequence,
            time_ns: pair.depth.time_ns.saturating_add(self.start_ns),
            depth,
            color,
        }))
    }
    fn skip_frame(&mut self) -> Result<bool, FormatError> {
        let is_there = self.next_pair()?.is_some();
        self.next += u64::from(is_there);
        Ok(is_there)
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.scanner.rewind();
        self.pending = PendingFrames::new(self.timing);
        self.next = 0;
        Ok(())
    }
}
