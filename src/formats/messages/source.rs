//! RGBD frames of a recording of messages, from any container.

use super::container::MessageContainer;
use super::fault::MessageFault;
use super::frame_decoder::FrameDecoder;
use super::pairing::NearestItem;
use super::selection::{TopicWish, other_channels};
use super::survey::Survey;
use super::topic_images::{TimeBase, TimedImage, TopicImages};
use crate::rgbd_source::{MAX_COLOR_GAP_NS, RgbdSource};
use crate::{CameraFile, FormatError};
use std::path::{Path, PathBuf};
use tryon_geometry::camera::{Calibration, ColorImage, LensCalibration, RgbdFrame};

/// Opens a container at its start.
pub(crate) type OpenContainer = fn(&Path) -> Result<Box<dyn MessageContainer>, FormatError>;

/// Choices that a recording leaves to its reader.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StreamOptions<'a> {
    /// Topic of depth, where a file has several.
    pub(crate) depth_topic: Option<&'a str>,
    /// Topic of colour.
    pub(crate) color_topic: Option<&'a str>,
    /// A `camera.json` instead of the recording's cameras.
    pub(crate) camera: Option<&'a Path>,
}

/// Chosen streams of a recording.
#[derive(Clone, Debug)]
struct ChosenStreams {
    depth: String,
    color: Option<String>,
    times: TimeBase,
    /// Time added to colour's stamps, nanoseconds.
    color_offset_ns: i64,
}

impl ChosenStreams {
    /// Readers of depth and of colour, each at the start of the file.
    fn readers(
        &self,
        path: &Path,
        open: OpenContainer,
    ) -> Result<(TopicImages, Option<TopicImages>), FormatError> {
        let images = |topic: &str| {
            let container = open(path)?;
            Ok::<_, FormatError>(TopicImages::new(
                path.to_owned(),
                container,
                topic,
                self.times,
            ))
        };
        let color = self.color.as_deref().map(images).transpose()?;
        Ok((images(&self.depth)?, color))
    }
}

/// Recording of messages, read frame by frame with memory for two depth and three colour messages. A truncated file
/// ends at its last whole message.
pub(crate) struct MessageSource {
    path: PathBuf,
    open: OpenContainer,
    streams: ChosenStreams,
    decoder: FrameDecoder,
    camera: CameraFile,
    notes: Vec<String>,
    /// Notes of opening; those of reading follow.
    opening_notes: usize,
    depth: TopicImages,
    /// The depth image after the last one returned, or the fault in its place.
    ahead: Option<Result<Option<TimedImage>, FormatError>>,
    /// Time of the depth image before it.
    behind_ns: Option<u64>,
    color: Option<TopicImages>,
    nearest: NearestItem<TimedImage>,
    /// Capture time of the last frame's colour, nanoseconds.
    color_time_ns: Option<u64>,
    counts: FrameCounts,
}

/// Frames of a reading so far.
#[derive(Clone, Copy, Debug, Default)]
struct FrameCounts {
    all: u64,
    without_color: u64,
    /// Sequence number of the last one.
    sequence: Option<u64>,
}

impl FrameCounts {
    /// Sequence number of the next frame: the one stated, or the next where writers leave it constant.
    fn number(&mut self, stated: u32) -> u64 {
        let least = self.sequence.map_or(0, |last| last + 1);
        let sequence = u64::from(stated).max(least);
        self.sequence = Some(sequence);
        sequence
    }
}

impl std::fmt::Debug for MessageSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MessageSource")
            .field("path", &self.path)
            .field("streams", &self.streams)
            .finish_non_exhaustive()
    }
}

impl MessageSource {
    /// Opens a recording: chooses its topics and reads their calibration.
    ///
    /// # Errors
    /// A damaged start, no depth, several depth topics without a choice, no camera for depth, or an unusable one.
    pub(crate) fn open(
        path: &Path,
        open: OpenContainer,
        options: StreamOptions<'_>,
    ) -> Result<Self, FormatError> {
        let survey = Survey::read(path, &mut *open(path)?)?;
        let (streams, camera, notes) = match Self::choose(path, &survey, options) {
            Ok(found) => found,
            // A message at fault is the likelier reason for what is missing.
            Err(e) => return Err(survey.fault.unwrap_or(e)),
        };
        let (depth, color) = streams.readers(path, open)?;
        Ok(Self {
            path: path.to_owned(),
            open,
            depth,
            color,
            decoder: FrameDecoder::new(path, camera.lenses.clone(), camera.depth_scale.recip()),
            camera,
            opening_notes: notes.len(),
            notes,
            streams,
            ahead: None,
            behind_ns: None,
            nearest: NearestItem::new(),
            color_time_ns: None,
            counts: FrameCounts::default(),
        })
    }

    /// Streams, decoder and notes of a recording.
    fn choose(
        path: &Path,
        survey: &Survey,
        options: StreamOptions<'_>,
    ) -> Result<(ChosenStreams, CameraFile, Vec<String>), FormatError> {
        let named = |f: MessageFault| FormatError::field(path, f.field, f.why);
        let wish = TopicWish {
            depth: options.depth_topic,
            color: options.color_topic,
        };
        let mut selection = survey.select(wish).map_err(named)?;
        let mut notes = std::mem::take(&mut selection.notes);
        let camera: CameraFile = match options.camera {
            Some(camera) => {
                if !survey.cameras.is_empty() {
                    let why = "not taken, --camera is";
                    notes.push(format!("cameras of the recording: {why}"));
                }
                CameraFile::read(camera)?
            }
            None => {
                let found = survey.calibrate(&selection).map_err(named)?;
                notes.extend(found.notes);
                CameraFile {
                    depth_scale: found.depth_unit.recip(),
                    ..found.lenses.into()
                }
            }
        };
        let (depth, color) = (selection.depth, selection.color);
        let has_stamps = depth.has_stamps && color.is_none_or(|c| c.has_stamps);
        if !has_stamps {
            let why = "no capture times (header.stamp); times of recording are taken";
            notes.push(format!("`{}`: {why}", depth.topic));
        }
        let streams = ChosenStreams {
            depth: depth.topic.clone(),
            color: color.map(|c| c.topic.clone()),
            times: if has_stamps {
                TimeBase::Stamp
            } else {
                TimeBase::Log
            },
            color_offset_ns: camera.color_time_offset_ns(),
        };
        Ok((streams, camera, notes))
    }

    /// The next depth image, and the time of the one after it.
    fn next_depth(&mut self) -> Result<Option<(TimedImage, Option<u64>)>, FormatError> {
        let current = match self.ahead.take() {
            Some(read) => read?,
            None => self.depth.next_image()?,
        };
        let Some(current) = current else {
            self.note_the_end();
            return Ok(None);
        };
        let ahead = self.depth.next_image();
        let next_ns = match &ahead {
            Ok(Some(next)) => Some(next.time_ns),
            _ => None,
        };
        self.ahead = Some(ahead);
        Ok(Some((current, next_ns)))
    }

    /// Colour of a depth image.
    fn color_at(
        &mut self,
        time_ns: u64,
        next_ns: Option<u64>,
    ) -> Result<Option<ColorImage>, FormatError> {
        let Some(stream) = &mut self.color else {
            return Ok(None);
        };
        self.color_time_ns = None;
        let offset = self.streams.color_offset_ns;
        let next = |_| match stream.next_image() {
            Ok(image) => Ok(image.map(|i| (i.time_ns.saturating_add_signed(offset), i))),
            // The depth reader reports the same damage.
            Err(_) if stream.is_ended() => Ok(None),
            Err(e) => Err(e),
        };
        let neighbours = [self.behind_ns.replace(time_ns), next_ns];
        let Some(paired) = self.nearest.pair(time_ns, neighbours, next)? else {
            return Ok(None);
        };
        self.color_time_ns = Some(paired.time_ns.saturating_add_signed(offset));
        self.decoder.color(paired).map(Some)
    }

    /// Notes topics that begin late, frames without colour, and a file that is cut short.
    fn note_the_end(&mut self) {
        let container = self.depth.container();
        let mut notes = other_channels(&container.channels());
        let known = |c: &str| self.notes.iter().any(|n| n.contains(&format!("`{c}`")));
        for c in container.channels() {
            let is_image = c.has_images();
            let is_chosen = c.topic == self.streams.depth
                || self.streams.color.as_ref().is_some_and(|t| *t == c.topic);
            if is_image && !is_chosen && !known(&c.topic) {
                notes.push(format!("`{}`: begins late, not taken", c.topic));
            }
        }
        let FrameCounts {
            all, without_color, ..
        } = self.counts;
        if let Some(color) = self.streams.color.as_ref().filter(|_| without_color > 0) {
            let gap = MAX_COLOR_GAP_NS as f64 * 1e-6;
            notes.push(format!(
                "`{color}`: {without_color} of {all} frames have no colour within {gap:.1} ms"
            ));
        }
        if container.is_cut_short() {
            notes.push("the file is cut short: frames end at its last whole message".into());
        }
        notes.retain(|n| !self.notes.contains(n));
        self.notes.append(&mut notes);
    }
}

impl RgbdSource for MessageSource {
    fn calibration(&self) -> &Calibration {
        self.decoder.calibration()
    }
    fn lenses(&self) -> LensCalibration {
        self.decoder.lenses()
    }
    fn camera_file(&self) -> CameraFile {
        self.camera.clone()
    }
    fn color_time_ns(&self) -> Option<u64> {
        self.color_time_ns
    }
    fn untaken(&self) -> &[String] {
        &self.notes
    }
    fn len(&self) -> Option<usize> {
        None
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        let Some((depth, next_ns)) = self.next_depth()? else {
            return Ok(None);
        };
        let color = self.color_at(depth.time_ns, next_ns)?;
        self.counts.all += 1;
        self.counts.without_color += u64::from(color.is_none());
        let stated = depth.image.sequence.unwrap_or(depth.head.sequence);
        Ok(Some(RgbdFrame {
            sequence: self.counts.number(stated),
            time_ns: depth.time_ns,
            depth: self.decoder.depth(&depth)?,
            color,
        }))
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        (self.depth, self.color) = self.streams.readers(&self.path, self.open)?;
        (self.ahead, self.behind_ns) = (None, None);
        (self.nearest, self.counts) = (NearestItem::new(), FrameCounts::default());
        self.notes.truncate(self.opening_notes);
        Ok(())
    }
}
