//! Second pass over a recording: outlines in depth and changes in colour, each with its time.

use super::binned;
use super::change::{ChangeImage, LEVELS};
use super::outline::{PersonOutline, outline};
use super::settings::ExtrinsicsSettings;
use super::survey::{CameraPair, EmptyScene};
use tryon_geometry::camera::{Intrinsics, RgbdFrame};

/// Longest time between two colour images that are interpolated (s).
const MOST_GAP: f64 = 0.11;
/// Seconds in a nanosecond.
const NANO: f64 = 1e-9;

/// Outlines and changes of a recording.
#[derive(Clone, Debug)]
pub(crate) struct WalkEvidence {
    /// Colour cameras of the levels of change images.
    pub(crate) cameras: [Intrinsics; LEVELS],
    /// By time (s).
    pub(crate) outlines: Vec<(f64, PersonOutline)>,
    /// By time (s).
    pub(crate) changes: Vec<(f64, ChangeImage)>,
    /// Frames compared.
    pub(crate) frames: usize,
}

/// Two neighbouring colour images and the place of a time between them, 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChangeBracket<'a> {
    pub(crate) images: [&'a ChangeImage; 2],
    pub(crate) part: f64,
    /// Time between them (s).
    pub(crate) gap: f64,
}

impl WalkEvidence {
    pub(crate) fn new(cameras: &CameraPair) -> Self {
        let half = |k: Intrinsics| binned::camera(&k, 2);
        let (whole, halves) = (cameras.color, half(cameras.color));
        Self {
            cameras: [whole, halves, half(halves)],
            outlines: Vec::new(),
            changes: Vec::new(),
            frames: 0,
        }
    }

    /// Takes a frame whose colour was taken `color_time_ns`.
    pub(crate) fn add(
        &mut self,
        frame: &RgbdFrame,
        color_time_ns: u64,
        cameras: &CameraPair,
        scene: &EmptyScene,
        settings: &ExtrinsicsSettings,
    ) {
        let Some(color) = &frame.color else {
            return;
        };
        self.frames += 1;
        let color = binned::color(color, cameras.factor);
        let change = ChangeImage::new(&cameras.color, &color, &scene.color);
        self.changes.push((color_time_ns as f64 * NANO, change));
        if let Some(found) = outline(&frame.depth, &scene.depth, settings) {
            self.outlines.push((frame.time_ns as f64 * NANO, found));
        }
    }

    /// Sorts by time.
    pub(crate) fn finish(&mut self) {
        self.outlines.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.changes.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.changes.dedup_by(|a, b| a.0 == b.0);
    }

    /// Colour images around a time of colour's clock (s).
    pub(crate) fn around(&self, time: f64) -> Option<ChangeBracket<'_>> {
        let after = self.changes.partition_point(|(t, _)| *t <= time);
        let (from, first) = self.changes.get(after.checked_sub(1)?)?;
        let (to, second) = self.changes.get(after)?;
        let gap = to - from;
        (gap <= MOST_GAP).then_some(ChangeBracket {
            images: [first, second],
            part: (time - from) / gap,
            gap,
        })
    }
}
