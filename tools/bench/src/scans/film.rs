//! Film of a dressed subject by one depth camera, with its truth.

use super::depth_camera::DepthCamera;
use super::points::ScanPoints;
use super::scene::{ScanScene, TrueScan};
use crate::EvaluateError;
use tryon_geometry::camera::RgbdFrame;

/// Frame of a film with its truth.
#[derive(Clone, Debug)]
pub struct FilmedFrame {
    /// Depth and colour.
    pub frame: RgbdFrame,
    /// True surfaces; scan points where wanted.
    pub truth: TrueScan,
}

impl ScanScene {
    /// Films the subject with one depth camera; `each` receives frames with their truth, which has scan points in the frames for which `is_scanned` is true.
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
            let seed = self.seed(moment.index);
            let frame = camera.shoot(moment.painted, seed, self.rate);
            let points = match is_scanned(moment.index) {
                true => self.scanner.scan(moment.painted, seed),
                false => ScanPoints::default(),
            };
            let truth = self.truth(&moment, points);
            each(FilmedFrame { frame, truth })
        })
    }
}
