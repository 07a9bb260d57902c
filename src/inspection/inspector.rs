//! Measurements gathered from the frames of a camera, and their report.

use crate::depth_range::{DepthHistogram, DepthRange};
use crate::holes::HoleShares;
use crate::light::{HoleColorSums, HoleColors};
use crate::place::{PlaceReport, inspect_place};
use crate::settings::{InspectionSettings, PersonSize};
use crate::temporal_noise::{NoiseEstimate, SensorModel, TemporalNoise};
use crate::timing::{FrameTimes, TimingReport};
use serde::Serialize;
use tryon_geometry::camera::{Calibration, DepthImage, Intrinsics, RgbdFrame};

/// Measurements of a camera: a frame costs a few passes over its pixels, the report some searches of the floor.
#[derive(Clone, Debug)]
pub struct Inspector {
    camera: Intrinsics,
    settings: InspectionSettings,
    times: FrameTimes,
    holes: Vec<HoleShares>,
    colors: HoleColorSums,
    histogram: DepthHistogram,
    noise: TemporalNoise,
    /// Images for the search of the floor.
    kept: Vec<DepthImage>,
    unreadable: usize,
}

/// Measurements of a camera and its place.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InspectionReport {
    /// Times of frames.
    pub timing: TimingReport,
    /// Frames that could not be read.
    pub unreadable: usize,
    /// Mean shares of pixels without depth.
    pub holes: HoleShares,
    /// Colours of these pixels, where colour is registered to depth.
    pub hole_colors: Option<HoleColors>,
    /// Depths in view; `None` without any reading.
    pub range: Option<DepthRange>,
    /// Noise against the sensor's model; `None` where it could not be measured.
    pub noise: Option<NoiseEstimate>,
    /// Kind of sensor of the model.
    pub model: SensorModel,
    /// Pose, room for a person, things in the way.
    pub place: PlaceReport,
}

impl Inspector {
    /// For upright, rectified frames of a camera.
    pub fn new(calibration: &Calibration, settings: InspectionSettings) -> Self {
        Self {
            camera: calibration.depth,
            settings,
            times: FrameTimes::default(),
            holes: Vec::new(),
            colors: HoleColorSums::default(),
            histogram: DepthHistogram::default(),
            noise: TemporalNoise::new(&calibration.depth),
            kept: Vec::new(),
            unreadable: 0,
        }
    }

    /// Adds a frame, and of a live one the time of its arrival by any steady clock (ns).
    pub fn add(&mut self, frame: &RgbdFrame, arrival_ns: Option<u64>) {
        self.times.add(frame.time_ns, arrival_ns);
        self.holes.push(HoleShares::of(&frame.depth));
        self.histogram.add(&frame.depth);
        self.noise.add(&frame.depth);
        // Registered colour may be missing in some frames.
        self.colors.add(frame);

        let due = self.kept.len() as f64 * self.settings.keep_every;
        let is_due = self.kept.is_empty() || self.times.span() >= due;
        if is_due && self.kept.len() < self.settings.kept_images {
            self.kept.push(frame.depth.clone());
        }
    }

    /// Counts frames that could not be read.
    pub fn add_unreadable(&mut self, frames: usize) {
        self.unreadable += frames;
    }

    /// Time measured so far (s): by arrival of live frames, else by their capture.
    pub fn span(&self) -> f64 {
        self.times.span()
    }

    /// Report; `None` without any frame.
    pub fn report(&self, model: SensorModel, person: &PersonSize) -> Option<InspectionReport> {
        let settings = &self.settings;
        Some(InspectionReport {
            timing: self.times.report(settings),
            unreadable: self.unreadable,
            holes: HoleShares::mean(&self.holes)?,
            hole_colors: self.colors.colors(),
            range: self.histogram.range(settings),
            noise: self.noise.estimate(model),
            model,
            place: inspect_place(&self.camera, &self.kept, settings, person),
        })
    }
}
