//! Rows `shimmer`: pixels of garments on a still subject that change from picture to picture.

use super::fault;
use super::film::WornFilm;
use super::gallery::{Crop, Gallery};
use super::plan::{PersonLook, Progress};
use super::signal::SignalPainter;
use crate::{EvaluateError, Row};
use std::path::PathBuf;
use tryon_formats::open_recording;
use tryon_geometry::camera::{Calibration, ColorImage, RgbdFrame};
use tryon_synth::{Routine, Sequence};

/// Change that is seen, grey levels of any channel.
const CHANGE: u8 = 8;
/// Pictures before the judged ones, and judged pairs.
const SETTLED: u64 = 150;
const PAIRS: u64 = 60;
/// Pictures between two whose garments are found anew.
const MASK_EVERY: u64 = 15;
/// Time between repeated pictures (ns).
const INTERVAL_NS: u64 = 33_333_333;
/// Share of a pixel that is a garment from which it belongs to one whole.
const WHOLE: f32 = 0.98;

/// Pictures of somebody who stands still.
pub(super) enum StillSource {
    /// Breathes and sways by millimetres, before a sensor with noise.
    Synth(PersonLook),
    /// The first picture of a recording, again and again.
    Repeated(PathBuf),
}

pub(super) struct ShimmerCase {
    pub(super) source: StillSource,
    pub(super) garments: &'static [&'static str],
}

/// Frames by number.
pub(super) enum Frames {
    Played(Box<Sequence>),
    Repeated(Calibration, Box<RgbdFrame>),
}

impl Frames {
    /// Opens a source.
    pub(super) fn open(source: &StillSource) -> Result<Self, EvaluateError> {
        match source {
            StillSource::Synth(look) => {
                let (actor, setting) = look.scene(Routine::Still);
                Ok(Self::Played(Box::new(Sequence::new(actor, setting))))
            }
            StillSource::Repeated(folder) => {
                let mut source = open_recording(folder).map_err(fault)?;
                let frame = source.next_frame().map_err(fault)?;
                let frame = frame.ok_or_else(|| fault("an empty recording"))?;
                Ok(Self::Repeated(
                    source.calibration().clone(),
                    Box::new(frame),
                ))
            }
        }
    }

    pub(super) fn calibration(&self) -> &Calibration {
        match self {
            Self::Played(sequence) => sequence.calibration(),
            Self::Repeated(calibration, _) => calibration,
        }
    }

    pub(super) fn get(&self, i: u64) -> RgbdFrame {
        match self {
            Self::Played(sequence) => sequence.frame(i).0,
            Self::Repeated(_, frame) => RgbdFrame {
                sequence: i,
                time_ns: i * INTERVAL_NS,
                ..(**frame).clone()
            },
        }
    }
}

/// Counts of pixels that change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ChangeCount {
    changed: usize,
    all: usize,
}

impl ChangeCount {
    /// Pixels of a mask that differ by more than `CHANGE` in any channel.
    fn add(&mut self, before: &ColorImage, after: &ColorImage, mask: &[bool]) {
        let pairs = before
            .data()
            .chunks_exact(3)
            .zip(after.data().chunks_exact(3));
        for ((a, b), _) in pairs.zip(mask).filter(|(_, m)| **m) {
            self.all += 1;
            self.changed += usize::from((0..3).any(|c| a[c].abs_diff(b[c]) > CHANGE));
        }
    }

    fn percent(&self) -> f64 {
        100.0 * self.changed as f64 / self.all as f64
    }
}

impl ShimmerCase {
    /// Plays the source and compares neighbouring pictures.
    pub(super) fn measure(&self, progress: &Progress<'_>) -> Result<Row, EvaluateError> {
        let frames = Frames::open(&self.source)?;
        let mut film = WornFilm::new(frames.calibration(), self.garments)?;
        let mut painter = SignalPainter::new();
        let (mut garment, mut edge) = (ChangeCount::default(), ChangeCount::default());
        let mut captured = ChangeCount::default();
        let mut last: Option<(ColorImage, ColorImage)> = None;
        let (mut whole, mut partial) = (Vec::new(), Vec::new());
        let mut gallery = Gallery::default();
        let pairs = if progress.is_quick() {
            PAIRS / 3
        } else {
            PAIRS
        };
        for i in 0..SETTLED + pairs {
            let frame = frames.get(i);
            let seen = film.step(&frame)?;
            let Some(scene) = film.scene().filter(|_| seen.is_dressed) else {
                continue;
            };
            if i % MASK_EVERY == 0 {
                let cover = painter.cover(&film, &frame, &scene)?;
                whole = cover.iter().map(|c| *c >= WHOLE).collect();
                partial = cover.iter().map(|c| *c > 0.0 && *c < WHOLE).collect();
            }
            let Some(color) = frame.color.filter(|_| i >= SETTLED) else {
                continue;
            };
            if let Some((picture, photo)) = &last {
                garment.add(picture, &seen.picture, &whole);
                edge.add(picture, &seen.picture, &partial);
                captured.add(photo, &color, &whole);
                if i % (2 * MASK_EVERY) == 0 {
                    let marks = (0..whole.len()).filter(|i| whole[*i]);
                    let crop = Crop::around(marks, [color.width(), color.height()]);
                    gallery.add(&seen.picture, &crop);
                    gallery.add(&differences(picture, &seen.picture), &crop);
                }
            }
            last = Some((seen.picture, color));
        }
        progress.write(gallery)?;
        Ok(
            Row::new(progress.scene(), self.garments.join("+"), film.run_ms())
                .with("pictures", pairs)
                .with("pixels", garment.all)
                .error("changed_percent", garment.percent())
                .error("changed_at_edges_percent", edge.percent())
                .error("photo_changed_percent", captured.percent()),
        )
    }
}

/// Absolute differences, sixteen times as bright.
fn differences(before: &ColorImage, after: &ColorImage) -> ColorImage {
    let mut out = after.clone();
    let pairs = out.data_mut().iter_mut().zip(before.data());
    pairs.for_each(|(b, a)| *b = b.abs_diff(*a).saturating_mul(16));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_counts_when_a_channel_changes_by_nine_levels() {
        let picture = |levels: [u8; 3]| {
            let data = levels.iter().flat_map(|l| [100, *l, 100]).collect();
            ColorImage::new(3, 1, data).expect("size")
        };
        let mut count = ChangeCount::default();
        let (before, after) = (picture([100; 3]), picture([108, 109, 200]));
        count.add(&before, &after, &[true, true, false]);
        assert_eq!(count, ChangeCount { changed: 1, all: 2 });
        assert_eq!(count.percent(), 50.0);
        assert_eq!(differences(&before, &after).at(1, 0), [0, 144, 0]);
    }
}
