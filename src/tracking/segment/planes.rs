//! Planes of the scene: the floor and the background, their tolerances, and the upright frame of the floor.

use crate::settings::PlaneSettings;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use tryon_geometry::math::{Camera, P3, Rigid, World};

/// Axial noise of the sensor: this × z² (metres), from Nguyen et al. 2012 (Kinect v1), twice the standard deviation.
pub(super) const NOISE_PER_SQUARE_METRE: f32 = 0.004;

/// Points p with `normal · p + offset = 0`; the normal points to the camera's side.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScenePlane {
    /// Unit normal, camera frame.
    pub normal: Vector3<f64>,
    /// Distance of the camera from the plane, metres.
    pub offset: f64,
}

impl ScenePlane {
    /// Signed distance, positive on the camera's side, metres.
    pub fn distance(&self, p: &P3) -> f32 {
        self.normal.cast::<f32>().dot(&p.coords) + self.offset as f32
    }
    /// Distance at which a measured point may lie off the plane, metres: floor tolerance and depth noise.
    pub(super) fn tolerance(&self, p: &P3, settings: &PlaneSettings) -> f32 {
        // Depth noise acts along the ray; only its part along the normal leaves the plane.
        let along = (self.normal.cast::<f32>().dot(&p.coords)
            / p.coords.norm().max(f32::MIN_POSITIVE))
        .abs();
        settings.floor_tolerance + NOISE_PER_SQUARE_METRE * p.z * p.z * along
    }
    /// True if the point belongs to the plane.
    pub(super) fn contains(&self, p: &P3, settings: &PlaneSettings) -> bool {
        self.distance(p).abs() < self.tolerance(p, settings)
    }
}

/// Planes of the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ScenePlanes {
    /// The floor.
    pub floor: Option<ScenePlane>,
    /// Walls and other large planes with nothing behind them.
    pub background: Vec<ScenePlane>,
}

impl ScenePlanes {
    /// Pose of the camera in the upright world frame: floor at y = 0 below the camera, −z along the view.
    /// Without a floor the camera is assumed level at `height` metres.
    pub fn world_from_camera(&self, height: f64) -> Rigid<World, Camera> {
        let Some(floor) = self.floor else {
            return Rigid::level(height);
        };
        let up = floor.normal;
        let forward = Vector3::z();
        let Some(back) = (-(forward - up * up.dot(&forward))).try_normalize(f64::EPSILON) else {
            return Rigid::level(height);
        };
        let right = up.cross(&back);
        // Rows are the world's axes in camera coordinates.
        let rotation =
            nalgebra::Matrix3::from_rows(&[right.transpose(), up.transpose(), back.transpose()]);
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Rigid::from_parts(Vector3::new(0.0, floor.offset, 0.0), rotation)
    }
}
