//! Intrinsics, depth and colour images, projection, noise models, what a sensor saw and when.

mod image;
pub(crate) mod intrinsics;
pub(crate) mod lens;
pub(crate) mod mounting;
pub(crate) mod noise;
pub(crate) mod rectify;
pub(crate) mod register;
pub(crate) mod reorient;
mod resample;
pub(crate) mod undistort;

pub use image::{ColorImage, DepthImage, FrameSizeError, ImageError};
pub use intrinsics::{Intrinsics, IntrinsicsError};
pub use lens::{Distortion, DistortionError, Lens, LensCalibration};
pub use mounting::{Mounting, PictureTurn, PictureTurnError};
pub use noise::{
    KINECT_V1_LATERAL_SIGMA, NoiseModel, NoiseSettings, kinect_v1_axial_sigma,
    time_of_flight_axial_sigma,
};
pub use rectify::Rectifier;
pub use register::Registration;
pub use reorient::Reorienter;

use crate::math::{Camera, ColorCamera, Rigid};
use serde::{Deserialize, Serialize};

/// Calibration of a camera: constant while it runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Depth camera.
    pub depth: Intrinsics,
    /// Colour camera; `None` when there is no colour or it is registered to depth.
    pub color: Option<Intrinsics>,
    /// From depth camera to colour camera; identity when registered.
    pub color_from_depth: Rigid<ColorCamera, Camera>,
}

impl Calibration {
    /// Depth only, or colour registered pixel by pixel to depth.
    pub fn registered(depth: Intrinsics) -> Self {
        Self {
            depth,
            color: None,
            color_from_depth: Rigid::identity(),
        }
    }
}

/// One exposure: depth, optional colour and capture time.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbdFrame {
    /// Number within the epoch, without gaps at the sensor.
    pub sequence: u64,
    /// Capture time, nanoseconds of the sensor's clock.
    pub time_ns: u64,
    /// Depth in millimetres, 0 = no reading.
    pub depth: DepthImage,
    /// Colour, if the camera has any.
    pub color: Option<ColorImage>,
}
