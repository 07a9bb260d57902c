//! Calibration without distortion, of a recording's lenses.

use tryon_geometry::camera::{Calibration, LensCalibration};

/// The pinholes of a recording's lenses.
pub(crate) fn pinholes(lenses: &LensCalibration) -> Calibration {
    Calibration {
        depth: lenses.depth.intrinsics,
        color: lenses.color.map(|c| c.intrinsics),
        color_from_depth: lenses.color_from_depth,
    }
}
