//! Film of a dressed subject by one depth camera, with its truth.

use super::depth_camera::DepthCamera;
use super::paint::PaintedSurface;
use super::points::ScanPoints;
use super::random::ScanSeed;
use super::scene::{ScanScene, TrueScan};
use crate::EvaluateError;
use tryon_geometry::camera::RgbdFrame;

/// Frame of a film with its truth.
#[derive(Clone, Debug)]
pub struct FilmedFrame {
    /// Depth and colour.
    pub frame: RgbdFrame,
    /// Garment from 1, [`SKIN_LABEL`](super::SKIN_LABEL), or [`STRAY_LABEL`](super::STRAY_LABEL) beside the subject. Shape `[pixels]`.
    pub labels: Vec<u8>,
    /// True surfaces; scan points where wanted.
    pub truth: TrueScan,
}

impl ScanScene {
    /// Films the subject with one depth camera; `each` receives frames with the label of each pixel and the truth, which has
    /// scan points in the frames for which `is_scanned` is true.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn film(
        &self,
        camera: &DepthCamera,
        is_scanned: impl Fn(usize) -> bool,
        mut each: impl FnMut(FilmedFrame) -> Result<(), EvaluateError>,
    ) -> Result<(), EvaluateError> {
        self.play(|moment| {
            let painted = PaintedSurface {
                surface: moment.surface,
                paint: moment.paint,
            };
            let (frame, labels) = camera.shoot(painted, moment.index, self.seed, self.rate);
            let seed = ScanSeed {
                scene: self.seed,
                scan: moment.index as u64,
            };
            let points = match is_scanned(moment.index) {
                true => self.scanner.scan(moment.surface, moment.paint, seed),
                false => ScanPoints::default(),
            };
            let truth = self.truth(&moment, points);
            each(FilmedFrame {
                frame,
                labels,
                truth,
            })
        })
    }
}
