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

use crate::math::{Camera, ColorCamera, P3, Rigid};
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

    /// Colour where a point of the depth camera (metres) is seen; `None` beside the image. A registered image may be larger
    /// than its camera.
    pub fn color_at(&self, image: &ColorImage, point: &P3) -> Option<[u8; 3]> {
        let camera = self.color.as_ref().unwrap_or(&self.depth);
        let seen = self.color_from_depth.point(&point.cast()).cast();
        let pixel = camera.resized(image.width(), image.height()).project(&seen);
        let [u, v] = [pixel.x, pixel.y].map(f32::round);
        let [width, height] = [image.width() as f32, image.height() as f32];
        let is_inside = u >= 0.0 && v >= 0.0 && u < width && v < height;
        is_inside.then(|| image.at(u as u32, v as u32))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_has_the_colour_of_its_pixel_in_an_image_of_any_size() {
        let camera = Intrinsics::KINECT_V1.resized(64, 48);
        let registered = Calibration::registered(camera);
        let point = camera.unproject(10.0, 20.0, 2.0);
        for scale in [1, 2] {
            let (width, height) = (64 * scale, 48 * scale);
            let pixel = |i: u32| [(i % width) as u8, (i / width) as u8, 0];
            let data = (0..width * height).flat_map(pixel).collect();
            let image = ColorImage::new(width, height, data).expect("sizes");
            let [u, v, _] = registered.color_at(&image, &point).expect("inside");
            let at = |x: u32| (x * scale) as u8..=((x + 1) * scale) as u8;
            assert!(at(10).contains(&u) && at(20).contains(&v), "{u} {v}");
            let beside = camera.unproject(70.0, 20.0, 2.0);
            assert_eq!(registered.color_at(&image, &beside), None);
        }
    }
}
