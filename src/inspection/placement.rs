//! Height, tilt and roll of a camera, from the floor in its depth images.

use crate::settings::InspectionSettings;
use serde::Serialize;
use tryon_geometry::camera::{
    Calibration, DepthImage, Intrinsics, Mounting, PictureTurn, Reorienter, RgbdFrame,
};
use tryon_geometry::math::order_statistics::median;
use tryon_geometry::spatial::OrganisedCloud;
use tryon_tracking::segment::{ScenePlane, find_planes};
use tryon_tracking::settings::PlaneSettings;

/// Pose of a camera over the floor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CameraPlacement {
    /// Height above the floor (m).
    pub height: f64,
    /// Tilt of the optical axis below the horizontal (degrees).
    pub down_deg: f64,
    /// Clockwise roll as seen from behind the camera (degrees).
    pub roll_deg: f64,
}

impl CameraPlacement {
    /// Pose over a floor plane in the camera frame.
    pub fn over(floor: &ScenePlane) -> Self {
        let up = &floor.normal;
        Self {
            height: floor.offset,
            down_deg: (-up.z).clamp(-1.0, 1.0).asin().to_degrees(),
            roll_deg: (-up.x).atan2(-up.y).to_degrees(),
        }
    }

    /// Median over several images; `None` of none.
    pub(crate) fn median(of: &[Self]) -> Option<Self> {
        let middle = |part: fn(&Self) -> f64| median(&mut of.iter().map(part).collect::<Vec<_>>());
        Some(Self {
            height: middle(|p| p.height)?,
            down_deg: middle(|p| p.down_deg)?,
            roll_deg: middle(|p| p.roll_deg)?,
        })
    }
}

/// Sampled points of an image.
pub(crate) fn cloud(
    camera: &Intrinsics,
    depth: &DepthImage,
    settings: &InspectionSettings,
) -> OrganisedCloud {
    let mut cloud = OrganisedCloud::new(camera, None);
    cloud.sample(depth, settings.farthest);
    cloud
}

/// Floor in a sampled image.
pub(crate) fn floor(cloud: &OrganisedCloud) -> Option<ScenePlane> {
    find_planes(cloud, &PlaneSettings::default()).floor
}

/// Turn after which an image without a floor has one: the camera hangs on its side, or upside down. A wall may pass for it.
pub(crate) fn turn_with_floor(
    camera: &Intrinsics,
    depth: &DepthImage,
    settings: &InspectionSettings,
) -> Option<PictureTurn> {
    let turns = [
        PictureTurn::Quarter,
        PictureTurn::ThreeQuarters,
        PictureTurn::Half,
    ];
    turns.into_iter().find(|turned| {
        let mounting = Mounting {
            turned: *turned,
            mirrored: false,
        };
        let lenses = Calibration::registered(*camera).into();
        let mut reorienter = Reorienter::new(mounting, &lenses);
        let mut frame = RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: depth.clone(),
            color: None,
        };
        let done = reorienter.reorient(&mut frame);
        let upright = reorienter.calibration().depth;
        done.is_ok() && floor(&cloud(&upright, &frame.depth, settings)).is_some()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn poses_over_a_plane_have_their_closed_form() {
        let (tilt, roll) = (12.0f64.to_radians(), 4.0f64.to_radians());
        // Up of a level camera is −y; tilted down it leans away from the optical axis, rolled clockwise to the left.
        let tilted = Vector3::new(0.0, -tilt.cos(), -tilt.sin());
        let rolled = Vector3::new(tilted.y * roll.sin(), tilted.y * roll.cos(), tilted.z);
        let placement = CameraPlacement::over(&ScenePlane {
            normal: rolled,
            offset: 1.3,
        });
        assert_eq!(placement.height, 1.3);
        assert!((placement.down_deg - 12.0).abs() < 1e-9, "{placement:?}");
        assert!((placement.roll_deg - 4.0).abs() < 1e-9, "{placement:?}");
    }
}
