//! `metadata` of a Record3D recording.

use crate::FormatError;
use serde_json::Value;
use std::path::Path;
use tryon_geometry::camera::{Calibration, Intrinsics};
use tryon_geometry::math::Rigid;

/// Frames per second of a file that states none.
const DEFAULT_FPS: f64 = 30.0;

/// Relative deviation of a frame's focal length from that of the file above which it is noted.
const FOCAL_TOLERANCE: f64 = 0.005;

/// Calibration and times of a recording.
#[derive(Clone, Debug)]
pub(super) struct R3dMetadata {
    /// Depth at its own size; colour at its own, if that differs. Both are of one view.
    pub(super) calibration: Calibration,
    /// Frame period, nanoseconds.
    period_ns: f64,
    /// Times of the frames, seconds from the first; empty without.
    times: Vec<f64>,
    /// Fields that no frame shows.
    pub(super) notes: Vec<String>,
}

impl R3dMetadata {
    /// Reads and checks the fields.
    ///
    /// # Errors
    /// Names the field at fault.
    pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Self, FormatError> {
        let json: Value = serde_json::from_slice(bytes)
            .map_err(|e| FormatError::field(path, "metadata", e.to_string()))?;
        let color = intrinsics(path, &json)?;
        let depth = match (side(path, &json, "dw")?, side(path, &json, "dh")?) {
            (Some(width), Some(height)) => validated(path, color.resized(width, height))?,
            _ => color,
        };
        let fps = json["fps"].as_f64().filter(|f| *f > 0.0);
        let times = json["frameTimestamps"].as_array();
        let times = times.map(|t| t.iter().filter_map(Value::as_f64).collect());
        Ok(Self {
            notes: notes(&json, &color),
            calibration: Calibration {
                depth,
                color: (color != depth).then_some(color),
                color_from_depth: Rigid::identity(),
            },
            period_ns: 1e9 / fps.unwrap_or(DEFAULT_FPS),
            times: times.unwrap_or_default(),
        })
    }

    /// Capture time of a frame, nanoseconds since the start: as stated, else by the frame rate.
    pub(super) fn time_ns(&self, frame: u64) -> u64 {
        let stated = usize::try_from(frame).ok().and_then(|i| self.times.get(i));
        let first = self.times.first().copied().unwrap_or(0.0);
        match stated {
            Some(time) => ((time - first) * 1e9).round() as u64,
            None => (frame as f64 * self.period_ns).round() as u64,
        }
    }
}

/// A side in pixels; `None` without the field.
fn side(path: &Path, json: &Value, field: &str) -> Result<Option<u32>, FormatError> {
    match &json[field] {
        Value::Null => Ok(None),
        v => v
            .as_f64()
            .filter(|n| n.fract() == 0.0 && *n >= 1.0 && *n <= f64::from(u32::MAX))
            .map(|n| Some(n as u32))
            .ok_or_else(|| FormatError::field(path, field, format!("{v}, expected pixels"))),
    }
}

/// Colour camera: `K`, column by column, at `w` × `h`.
fn intrinsics(path: &Path, json: &Value) -> Result<Intrinsics, FormatError> {
    let fault = |why: &str| FormatError::field(path, "K", why);
    let list = json["K"].as_array().filter(|k| k.len() == 9);
    let k: Option<Vec<f64>> = list.and_then(|l| l.iter().map(Value::as_f64).collect());
    let k = k.ok_or_else(|| fault("expected 9 numbers, column by column"))?;
    let is_pinhole = [1, 2, 3, 5].iter().all(|i| k[*i].abs() < 1e-6) && (k[8] - 1.0).abs() < 1e-6;
    if !is_pinhole {
        return Err(fault("expected fx, 0, 0, 0, fy, 0, cx, cy, 1"));
    }
    let side = |field: &str| {
        let side = side(path, json, field)?;
        side.ok_or_else(|| FormatError::field(path, field, "missing"))
    };
    let intrinsics = Intrinsics {
        width: side("w")?,
        height: side("h")?,
        fx: k[0],
        fy: k[4],
        cx: k[6],
        cy: k[7],
    };
    validated(path, intrinsics)
}

fn validated(path: &Path, intrinsics: Intrinsics) -> Result<Intrinsics, FormatError> {
    intrinsics.validated().map_err(|e| {
        let why = format!("{} is {}, expected {}", e.field, e.value, e.why);
        FormatError::field(path, "K", why)
    })
}

/// Notes on the camera's motion and focus.
fn notes(json: &Value, color: &Intrinsics) -> Vec<String> {
    let mut notes = Vec::new();
    if json["poses"].as_array().is_some_and(|p| !p.is_empty()) {
        notes.push("poses: motion of the camera is not used".to_owned());
    }
    let focal = json["perFrameIntrinsicCoeffs"]
        .as_array()
        .into_iter()
        .flatten();
    let deviation = |k: &Value| k[0].as_f64().map_or(0.0, |fx| (fx / color.fx - 1.0).abs());
    let most = focal.map(deviation).fold(0.0, f64::max);
    if most > FOCAL_TOLERANCE {
        let percent = 100.0 * most;
        notes.push(format!(
            "perFrameIntrinsicCoeffs: focus changes the focal length by up to {percent:.1} %; all frames have that of K"
        ));
    }
    notes
}
