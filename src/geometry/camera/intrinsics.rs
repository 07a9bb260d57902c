//! The pinhole camera.

use crate::math::P3;
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

/// A pinhole without distortion. Pixel centres are at integers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Intrinsics {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal length along x, pixels.
    pub fx: f64,
    /// Focal length along y, pixels.
    pub fy: f64,
    /// Principal point, column.
    pub cx: f64,
    /// Principal point, row.
    pub cy: f64,
}

/// A calibration field outside its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("camera.{field}: {value} is not usable ({why})")]
pub struct IntrinsicsError {
    /// Field name as in camera.json.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// Allowed values.
    pub why: &'static str,
}

/// Largest side of an image, pixels: a larger one is a broken file.
const MAX_SIDE: u32 = 16_384;

impl Intrinsics {
    /// The Kinect v1 at 640×480 (the paper's camera).
    pub const KINECT_V1: Self = Self {
        width: 640,
        height: 480,
        fx: 525.0,
        fy: 525.0,
        cx: 319.5,
        cy: 239.5,
    };

    /// Checks every field.
    ///
    /// # Errors
    /// [`IntrinsicsError`] naming the first bad field.
    pub fn validated(self) -> Result<Self, IntrinsicsError> {
        for (field, side) in [("width", self.width), ("height", self.height)] {
            if side == 0 || side > MAX_SIDE {
                return Err(IntrinsicsError {
                    field,
                    value: f64::from(side),
                    why: "1 to 16384 pixels",
                });
            }
        }
        for (field, value) in [("fx", self.fx), ("fy", self.fy)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(IntrinsicsError {
                    field,
                    value,
                    why: "a positive number of pixels",
                });
            }
        }
        for (field, value) in [("cx", self.cx), ("cy", self.cy)] {
            if !value.is_finite() {
                return Err(IntrinsicsError {
                    field,
                    value,
                    why: "a finite number of pixels",
                });
            }
        }
        Ok(self)
    }
    /// Columns and rows.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }
    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
    /// Image coordinates of a camera-frame point; undefined for z ≤ 0.
    pub fn project(&self, p: &P3) -> Point2<f32> {
        Point2::new(
            p.x / p.z * self.fx as f32 + self.cx as f32,
            p.y / p.z * self.fy as f32 + self.cy as f32,
        )
    }
    /// Camera-frame point of a pixel at depth `z` metres.
    pub fn unproject(&self, u: f32, v: f32, z: f32) -> P3 {
        P3::new(
            (u - self.cx as f32) / self.fx as f32 * z,
            (v - self.cy as f32) / self.fy as f32 * z,
            z,
        )
    }
    /// The same view at another resolution.
    pub fn resized(&self, width: u32, height: u32) -> Self {
        let (sx, sy) = (
            f64::from(width) / f64::from(self.width),
            f64::from(height) / f64::from(self.height),
        );
        // Pixel centres at integers: the image spans −0.5 … width − 0.5.
        Self {
            width,
            height,
            fx: self.fx * sx,
            fy: self.fy * sy,
            cx: (self.cx + 0.5) * sx - 0.5,
            cy: (self.cy + 0.5) * sy - 0.5,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_round_trips_and_resizes() {
        let k = Intrinsics::KINECT_V1;
        let p = k.unproject(100.0, 200.0, 2.5);
        let q = k.project(&p);
        assert!((q - Point2::new(100.0, 200.0)).norm() < 1e-3);
        let half = k.resized(320, 240).project(&p);
        assert!((half.x - (100.5 / 2.0 - 0.5)).abs() < 1e-3);
    }

    #[test]
    fn bad_fields_are_named() {
        let e = Intrinsics {
            fx: f64::NAN,
            ..Intrinsics::KINECT_V1
        }
        .validated()
        .expect_err("NaN");
        assert_eq!(e.field, "fx");
        assert_eq!(
            Intrinsics {
                width: 0,
                ..Intrinsics::KINECT_V1
            }
            .validated()
            .expect_err("0")
            .field,
            "width"
        );
    }
}
