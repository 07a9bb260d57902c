//! `calibration.json` of an Azure Kinect, for the resolutions of a recording.
//!
//! The file states the lenses on the whole sensors: depth on 1024 × 1024 pixels, colour on 4:3. Principal point and focal
//! length are fractions of the sensor's sides, from the corner of the first pixel; a mode bins, scales and crops it.

use crate::FormatError;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde_json::Value;
use std::path::Path;
use tryon_geometry::camera::{Distortion, Intrinsics, Lens, LensCalibration};
use tryon_geometry::math::Rigid;

/// Locations of the two cameras.
const DEPTH: &str = "CALIBRATION_CameraLocationD0";
const COLOR: &str = "CALIBRATION_CameraLocationPV0";
/// Lens model of every device on sale.
const BROWN_CONRADY: &str = "CALIBRATION_LensDistortionModelBrownConrady";
/// Principal point (2), focal length (2), k₁ … k₆, centre of distortion (2), p₂, p₁.
const PARAMETERS: usize = 14;
/// Metric radius where the file states 0, for a fit that found none: the device's SDK takes the same.
const DEFAULT_RADIUS: f64 = 1.7;
/// Side of the depth sensor, pixels.
const DEPTH_SENSOR: f64 = 1024.0;
/// Largest deviation of a rotation's rows from orthonormal ones; the file has six digits.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// Part of a sensor that a mode reads.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SensorMode {
    /// Size of the binned or scaled sensor, pixels.
    sensor: [f64; 2],
    /// First pixel of the image on it.
    crop: [f64; 2],
}

/// Depth mode by its image: NFOV crops the sensor to 640 × 576, WFOV reads all of it, each also binned 2 × 2.
fn depth_mode(width: u32, height: u32) -> Option<SensorMode> {
    let (binning, crop) = match (width, height) {
        (640, 576) => (1.0, [192.0, 180.0]),
        (320, 288) => (2.0, [96.0, 90.0]),
        (1024, 1024) => (1.0, [0.0; 2]),
        (512, 512) => (2.0, [0.0; 2]),
        _ => return None,
    };
    let sensor = [DEPTH_SENSOR / binning; 2];
    Some(SensorMode { sensor, crop })
}

/// Colour mode by its image: the whole sensor at 4:3, its middle rows at 16:9.
fn color_mode(width: u32, height: u32) -> Option<SensorMode> {
    let whole = f64::from(width) * 3.0 / 4.0;
    let is_wide = u64::from(width) * 9 == u64::from(height) * 16;
    let is_whole = u64::from(width) * 3 == u64::from(height) * 4;
    (is_wide || is_whole).then(|| SensorMode {
        sensor: [f64::from(width), whole],
        crop: [0.0, (whole - f64::from(height)) / 2.0],
    })
}

/// A camera of the file.
struct SensorCamera {
    /// Fractions of the sensor: principal point, focal length.
    center: [f64; 2],
    focal: [f64; 2],
    distortion: Distortion,
    /// Sides, pixels.
    sensor: [f64; 2],
    /// From the device's frame, metres.
    rotation: UnitQuaternion<f64>,
    translation: Vector3<f64>,
}

/// Lenses at the sizes of the tracks, and the transform between the cameras.
///
/// # Errors
/// Names the field at fault, or a size that is no mode of the camera.
pub(super) fn lenses(
    path: &Path,
    json: &[u8],
    depth: (u32, u32),
    color: Option<(u32, u32)>,
) -> Result<LensCalibration, FormatError> {
    let file: Value = serde_json::from_slice(trimmed(json))
        .map_err(|e| FormatError::field(path, "calibration.json", e.to_string()))?;
    let depth_camera = SensorCamera::find(path, &file, DEPTH)?;
    let size = |field: &str, (w, h): (u32, u32)| {
        FormatError::field(
            path,
            field,
            format!("{w}×{h} is no mode of an Azure Kinect"),
        )
    };
    let mode = depth_mode(depth.0, depth.1).ok_or_else(|| size("DEPTH", depth))?;
    let depth_lens = depth_camera.lens(path, mode, depth)?;
    let Some(color) = color else {
        return Ok(LensCalibration {
            depth: depth_lens,
            color: None,
            color_from_depth: Rigid::identity(),
        });
    };
    let color_camera = SensorCamera::find(path, &file, COLOR)?.whole_sensor();
    let mode = color_mode(color.0, color.1).ok_or_else(|| size("COLOR", color))?;
    let rotation = color_camera.rotation * depth_camera.rotation.inverse();
    let translation = color_camera.translation - rotation * depth_camera.translation;
    Ok(LensCalibration {
        depth: depth_lens,
        color: Some(color_camera.lens(path, mode, color)?),
        color_from_depth: Rigid::from_parts(translation, rotation),
    })
}

/// Text without the NUL bytes that devices end it with.
fn trimmed(json: &[u8]) -> &[u8] {
    let end = json.iter().rposition(|b| *b != 0).map_or(0, |i| i + 1);
    &json[..end]
}

impl SensorCamera {
    fn find(path: &Path, file: &Value, location: &str) -> Result<Self, FormatError> {
        let fault = |field: &str, why: &str| {
            let name = format!("calibration.json: {location}.{field}");
            FormatError::field(path, name, why)
        };
        let cameras = file
            .pointer("/CalibrationInformation/Cameras")
            .and_then(Value::as_array);
        let camera = cameras
            .and_then(|all| all.iter().find(|c| c["Location"] == location))
            .ok_or_else(|| fault("Location", "no such camera"))?;
        if camera["Intrinsics"]["ModelType"] != BROWN_CONRADY {
            let why = format!(
                "{}, expected {BROWN_CONRADY}",
                camera["Intrinsics"]["ModelType"]
            );
            return Err(fault("ModelType", &why));
        }
        let list = |field: &str, value: &Value, count: usize| {
            numbers(value, count)
                .ok_or_else(|| fault(field, &format!("expected {count} finite numbers")))
        };
        let p = list(
            "ModelParameters",
            &camera["Intrinsics"]["ModelParameters"],
            PARAMETERS,
        )?;
        if p[10] != 0.0 || p[11] != 0.0 {
            return Err(fault(
                "ModelParameters",
                "a centre of distortion beside the principal point",
            ));
        }
        let side = |name: &str| {
            let side = camera[name]
                .as_f64()
                .filter(|s| *s >= 1.0 && *s <= 65_536.0);
            side.ok_or_else(|| fault(name, "expected pixels"))
        };
        let rows = list("Rt.Rotation", &camera["Rt"]["Rotation"], 9)?;
        let t = list("Rt.Translation", &camera["Rt"]["Translation"], 3)?;
        Ok(Self {
            center: [p[0], p[1]],
            focal: [p[2], p[3]],
            distortion: Distortion {
                radial: [p[4], p[5], p[6], p[7], p[8], p[9]],
                tangential: [p[13], p[12]],
                limit: Some(
                    metric_radius(&camera["MetricRadius"])
                        .ok_or_else(|| fault("MetricRadius", "expected a radius of unit depth"))?,
                ),
            },
            sensor: [side("SensorWidth")?, side("SensorHeight")?],
            rotation: rotation(&rows).ok_or_else(|| fault("Rt.Rotation", "no rotation"))?,
            translation: Vector3::new(t[0], t[1], t[2]),
        })
    }

    /// The camera on the whole 4:3 sensor; early files state colour on the middle 16:9 of it.
    fn whole_sensor(mut self) -> Self {
        let [width, height] = self.sensor;
        if (width * 9.0 - height * 16.0).abs() < f64::EPSILON {
            let whole = width * 3.0 / 4.0;
            let above = (whole - height) / 2.0;
            self.center[1] = (self.center[1] * height + above) / whole;
            self.focal[1] *= height / whole;
            self.sensor[1] = whole;
        }
        self
    }

    /// Lens of an image in a mode. Pixel coordinates have their zero in the middle of the first pixel.
    fn lens(
        &self,
        path: &Path,
        mode: SensorMode,
        (width, height): (u32, u32),
    ) -> Result<Lens, FormatError> {
        let ratio = |[w, h]: [f64; 2]| w / h;
        if (ratio(mode.sensor) - ratio(self.sensor)).abs() > 1e-3 {
            let why = format!(
                "{:?}, expected the proportions of {:?}",
                self.sensor, mode.sensor
            );
            return Err(FormatError::field(
                path,
                "calibration.json: SensorWidth",
                why,
            ));
        }
        let center = |k: usize| self.center[k] * mode.sensor[k] - mode.crop[k] - 0.5;
        let intrinsics = Intrinsics {
            width,
            height,
            fx: self.focal[0] * mode.sensor[0],
            fy: self.focal[1] * mode.sensor[1],
            cx: center(0),
            cy: center(1),
        };
        let intrinsics = intrinsics.validated().map_err(|e| {
            let why = format!("{} is {}, expected {}", e.field, e.value, e.why);
            FormatError::field(path, "calibration.json: ModelParameters", why)
        })?;
        Ok(Lens {
            intrinsics,
            distortion: self.distortion,
        })
    }
}

/// Radius of rays, of unit depth, up to which the lens model holds: no pixel has a ray beyond.
fn metric_radius(stated: &Value) -> Option<f64> {
    let radius = match stated {
        Value::Null => 0.0,
        stated => stated.as_f64()?,
    };
    let is_radius = radius.is_finite() && radius >= 0.0;
    is_radius.then_some(if radius > 0.0 { radius } else { DEFAULT_RADIUS })
}

/// Exactly `count` finite numbers.
fn numbers(value: &Value, count: usize) -> Option<Vec<f64>> {
    let list = value.as_array().filter(|l| l.len() == count)?;
    list.iter()
        .map(|v| v.as_f64().filter(|x| x.is_finite()))
        .collect()
}

/// Rotation of a row-major matrix, if it is one.
fn rotation(rows: &[f64]) -> Option<UnitQuaternion<f64>> {
    let m = Matrix3::from_row_slice(rows);
    let is_rotation = (m * m.transpose() - Matrix3::identity()).amax() < ROTATION_TOLERANCE
        && m.determinant() > 0.0;
    is_rotation.then(|| {
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(m));
        UnitQuaternion::new_normalize(q.into_inner())
    })
}

#[cfg(test)]
#[path = "calibration_tests.rs"]
mod tests;
