//! `camera.json`: `{width, height, fx, fy, cx, cy, depth_scale}` and, for a separate colour camera,
//! `color: {width, height, fx, fy, cx, cy}` and `color_from_depth: {translation: [x, y, z], rotation: [x, y, z, w]}`.

use crate::FormatError;
use crate::image::read_limited;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde_json::{Map, Value, json};
use std::path::Path;
use tryon_geometry::camera::{Calibration, Intrinsics};
use tryon_geometry::math::Rigid;

/// Largest file, bytes; a calibration has a few hundred.
const MAX_BYTES: u64 = 1 << 20;

/// Units per metre of a file without `depth_scale`: millimetres.
const DEFAULT_SCALE: f64 = 1000.0;

/// Largest deviation of a quaternion's length from one; written with six digits it is within 1e-5.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Calibration and the unit of the depth images.
#[derive(Clone, Debug)]
pub(super) struct CameraFile {
    /// Calibration.
    pub(super) calibration: Calibration,
    /// Units per metre.
    pub(super) depth_scale: f64,
}

impl CameraFile {
    /// Reads and checks every field.
    pub(super) fn read(path: &Path) -> Result<Self, FormatError> {
        let bytes = read_limited(path, MAX_BYTES)?;
        // Python and Matlab write NaN and Infinity, which JSON lacks: the error names the field, not a column.
        let text = String::from_utf8_lossy(&bytes);
        if let Some(field) = not_a_number(&text) {
            return Err(FormatError::field(path, field, "not a finite number"));
        }
        let value: Value = serde_json::from_str(&text)
            .map_err(|e| FormatError::field(path, "json", e.to_string()))?;
        let Value::Object(map) = &value else {
            return Err(FormatError::field(path, "json", "expected an object"));
        };
        let depth = intrinsics(path, "", map)?;
        let depth_scale = match map.get("depth_scale") {
            None => DEFAULT_SCALE,
            Some(v) => number(path, "depth_scale", v)?,
        };
        if !(depth_scale.is_finite() && depth_scale > 0.0) {
            let why = format!("{depth_scale}, expected a positive number of units per metre");
            return Err(FormatError::field(path, "depth_scale", why));
        }
        let color = match map.get("color") {
            None | Some(Value::Null) => None,
            Some(Value::Object(c)) => Some(intrinsics(path, "color.", c)?),
            Some(_) => return Err(FormatError::field(path, "color", "expected an object")),
        };
        let color_from_depth = match map.get("color_from_depth") {
            None | Some(Value::Null) => Rigid::identity(),
            Some(v) => {
                let t: [f64; 3] =
                    numbers(path, "color_from_depth.translation", v.get("translation"))?;
                let q: [f64; 4] = numbers(path, "color_from_depth.rotation", v.get("rotation"))?;
                let q = Quaternion::new(q[3], q[0], q[1], q[2]);
                if (q.norm() - 1.0).abs() > UNIT_TOLERANCE {
                    let why = format!("length {}, expected a unit quaternion x, y, z, w", q.norm());
                    return Err(FormatError::field(path, "color_from_depth.rotation", why));
                }
                Rigid::from_parts(Vector3::from(t), UnitQuaternion::from_quaternion(q))
            }
        };
        Ok(Self {
            calibration: Calibration {
                depth,
                color,
                color_from_depth,
            },
            depth_scale,
        })
    }

    /// Text of the file.
    pub(super) fn to_json(&self) -> String {
        let fields = |k: &Intrinsics| json!({"width": k.width, "height": k.height, "fx": k.fx, "fy": k.fy, "cx": k.cx, "cy": k.cy});
        let mut root = fields(&self.calibration.depth);
        root["depth_scale"] = json!(self.depth_scale);
        if let Some(c) = &self.calibration.color {
            let iso = self.calibration.color_from_depth.iso();
            let q = iso.rotation.coords;
            root["color"] = fields(c);
            root["color_from_depth"] = json!({
                "translation": iso.translation.vector.as_slice(),
                "rotation": [q.x, q.y, q.z, q.w],
            });
        }
        format!("{root:#}\n")
    }
}

/// Key whose value is a bare NaN or Infinity.
fn not_a_number(text: &str) -> Option<&str> {
    let mut rest = text;
    while let Some(colon) = rest.find(':') {
        let (before, after) = rest.split_at(colon);
        let value = after[1..].trim_start().trim_start_matches(['-', '+']);
        if ["NaN", "nan", "Inf", "inf"]
            .iter()
            .any(|w| value.starts_with(w))
        {
            return before
                .trim_end()
                .strip_suffix('"')
                .and_then(|b| b.rsplit('"').next())
                .or(Some("json"));
        }
        rest = &after[1..];
    }
    None
}

fn number(path: &Path, field: &str, v: &Value) -> Result<f64, FormatError> {
    v.as_f64()
        .ok_or_else(|| FormatError::field(path, field, format!("{v}, expected a number")))
}

fn numbers<const N: usize>(
    path: &Path,
    field: &str,
    v: Option<&Value>,
) -> Result<[f64; N], FormatError> {
    let list = v.and_then(Value::as_array).filter(|a| a.len() == N);
    let list =
        list.ok_or_else(|| FormatError::field(path, field, format!("expected {N} numbers")))?;
    let mut out = [0.0; N];
    for (o, v) in out.iter_mut().zip(list) {
        *o = number(path, field, v)?;
    }
    Ok(out)
}

fn intrinsics(
    path: &Path,
    prefix: &str,
    map: &Map<String, Value>,
) -> Result<Intrinsics, FormatError> {
    let get = |key: &str| {
        let field = format!("{prefix}{key}");
        let v = map
            .get(key)
            .ok_or_else(|| FormatError::field(path, &field, "missing"))?;
        number(path, &field, v)
    };
    let side = |key: &str| {
        let v = get(key)?;
        if v.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&v) {
            return Err(FormatError::field(
                path,
                format!("{prefix}{key}"),
                format!("{v}, expected a whole number"),
            ));
        }
        Ok(v as u32)
    };
    let k = Intrinsics {
        width: side("width")?,
        height: side("height")?,
        fx: get("fx")?,
        fy: get("fy")?,
        cx: get("cx")?,
        cy: get("cy")?,
    };
    k.validated().map_err(|e| {
        FormatError::field(
            path,
            format!("{prefix}{}", e.field),
            format!("{}, expected {}", e.value, e.why),
        )
    })
}
