//! First pass over a recording: the empty scene.

use super::binned;
use super::color_background::{ColorView, CoveredCells, color_background};
use super::depth_background::DepthBackground;
use super::error::ExtrinsicsError;
use super::settings::ExtrinsicsSettings;
use super::spread::SpreadSample;
use nalgebra::Isometry3;
use tryon_geometry::camera::{Calibration, DepthImage, Intrinsics, RgbdFrame};
use tryon_geometry::math::order_statistics::median;

/// Every how many pixels brightness is measured at.
const BRIGHTNESS_STRIDE: usize = 37;

/// Cameras of a recording, colour reduced.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraPair {
    pub(crate) depth: Intrinsics,
    pub(crate) color: Intrinsics,
    /// Factor by which colour is reduced.
    pub(crate) factor: u32,
    /// Extrinsics to start from.
    pub(crate) start: Isometry3<f64>,
}

impl CameraPair {
    pub(crate) fn new(
        calibration: &Calibration,
        settings: &ExtrinsicsSettings,
    ) -> Result<Self, ExtrinsicsError> {
        let color = calibration.color.ok_or(ExtrinsicsError::Registered)?;
        let factor = binned::factor(&color, settings.color_columns);
        Ok(Self {
            depth: calibration.depth,
            color: binned::camera(&color, factor),
            factor,
            start: *calibration.color_from_depth.iso(),
        })
    }
}

/// Empty scene of both cameras.
#[derive(Clone, Debug)]
pub(crate) struct EmptyScene {
    pub(crate) depth: DepthBackground,
    /// Interleaved, of the size of reduced colour.
    pub(crate) color: Vec<u8>,
}

/// Frames of which the empty scene is made.
pub(crate) struct SceneSurvey<'a> {
    cameras: &'a CameraPair,
    settings: &'a ExtrinsicsSettings,
    samples: SpreadSample<(DepthImage, Vec<u8>)>,
}

impl<'a> SceneSurvey<'a> {
    pub(crate) fn new(cameras: &'a CameraPair, settings: &'a ExtrinsicsSettings) -> Self {
        Self {
            cameras,
            settings,
            samples: SpreadSample::new(settings.background_frames),
        }
    }

    /// Takes a frame; those without colour are left out.
    pub(crate) fn add(&mut self, frame: RgbdFrame) {
        if let Some(color) = frame.color {
            let (depth, factor) = (frame.depth, self.cameras.factor);
            self.samples
                .push_with(|| (depth, binned::color(&color, factor)));
        }
    }

    /// Frames with colour.
    pub(crate) fn frames(&self) -> usize {
        self.samples.seen()
    }

    /// The empty scene.
    ///
    /// # Errors
    /// Too few frames, or a scene that is too dark.
    pub(crate) fn finish(self) -> Result<EmptyScene, ExtrinsicsError> {
        let (got, least) = (self.frames(), self.settings.least_frames);
        if got < least {
            return Err(ExtrinsicsError::TooFewFrames { got, least });
        }
        let CameraPair {
            depth,
            color,
            start,
            ..
        } = self.cameras;
        let samples = self.samples.items();
        let depths: Vec<&DepthImage> = samples.iter().map(|(depth, _)| depth).collect();
        let scene = DepthBackground::new(*depth, &depths, self.settings);
        let view = ColorView {
            depth,
            color,
            color_from_depth: start,
        };
        let covered: Vec<CoveredCells> = depths
            .iter()
            .map(|image| CoveredCells::new(&scene.person(image), image, view, self.settings))
            .collect();
        let colors: Vec<&[u8]> = samples.iter().map(|(_, color)| color.as_slice()).collect();
        let empty = color_background(color, &colors, &covered);

        let brightest = empty.chunks_exact(3).step_by(BRIGHTNESS_STRIDE);
        let mut brightest: Vec<u8> = brightest.filter_map(|p| p.iter().copied().max()).collect();
        let brightness = median(&mut brightest).unwrap_or(0);
        let least = self.settings.least_brightness;
        if brightness < least {
            return Err(ExtrinsicsError::TooDark { brightness, least });
        }
        Ok(EmptyScene {
            depth: scene,
            color: empty,
        })
    }
}
