//! `camera.json`: `{width, height, fx, fy, cx, cy, depth_scale}` and, for a separate colour camera,
//! `color: {width, height, fx, fy, cx, cy}` and `color_from_depth: {translation: [x, y, z], rotation: [x, y, z, w]}`.
//! Either camera may have a `distortion`: coefficients in OpenCV's order. `color_time_offset_s` is added to colour's times.

use super::FormatError;
use super::image::read_limited;
use super::private_file;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde_json::{Map, Value, json};
use std::path::Path;
use tryon_geometry::camera::{Distortion, Intrinsics, Lens, LensCalibration};
use tryon_geometry::math::{Camera, ColorCamera, Rigid};

/// Largest file, bytes; a calibration has a few hundred.
const MAX_BYTES: u64 = 1 << 20;

/// Units per metre of a file without `depth_scale`: millimetres.
const DEFAULT_SCALE: f64 = 1000.0;

/// Largest deviation of a quaternion's length from one; written with six digits it is within 1e-5.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Fewest units in a metre that are a depth camera's, and most metres a unit: a decimetre.
const COARSEST: f64 = 10.0;

/// Largest time offset of colour, seconds: more is a clock that was not set.
const MAX_TIME_OFFSET: f64 = 1.0;

/// Calibration of a recording or a camera: lenses, the unit of the depth images, and the clock of colour.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFile {
    /// Both cameras, distortion included.
    pub lenses: LensCalibration,
    /// Units of depth per metre.
    pub depth_scale: f64,
    /// Time to add to colour's times for the clock of depth, seconds. Depth pairs with the colour nearest after that.
    pub color_time_offset_s: f64,
}

impl From<LensCalibration> for CameraFile {
    /// Depth in millimetres, one clock.
    fn from(lenses: LensCalibration) -> Self {
        Self {
            lenses,
            depth_scale: DEFAULT_SCALE,
            color_time_offset_s: 0.0,
        }
    }
}

impl CameraFile {
    /// Reads and checks every field.
    ///
    /// # Errors
    /// Names the file and the field at fault.
    pub fn read(path: &Path) -> Result<Self, FormatError> {
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
        let color = match map.get("color") {
            None | Some(Value::Null) => None,
            Some(Value::Object(c)) => Some(lens(path, "color.", c)?),
            Some(_) => return Err(FormatError::field(path, "color", "expected an object")),
        };
        Ok(Self {
            lenses: LensCalibration {
                depth: lens(path, "", map)?,
                color,
                color_from_depth: color_from_depth(path, map)?,
            },
            depth_scale: depth_scale(path, map)?,
            color_time_offset_s: time_offset(path, map)?,
        })
    }

    /// Writes the file, for its owner to read.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), FormatError> {
        private_file::write(path, self.to_json().as_bytes()).map_err(|e| FormatError::io(path, e))
    }

    /// Time to add to colour's times, nanoseconds.
    pub(crate) fn color_time_offset_ns(&self) -> i64 {
        (self.color_time_offset_s * 1e9).round() as i64
    }

    /// Text of the file.
    fn to_json(&self) -> String {
        let mut root = lens_json(&self.lenses.depth);
        root["depth_scale"] = json!(self.depth_scale);
        if let Some(c) = &self.lenses.color {
            let iso = self.lenses.color_from_depth.iso();
            let q = iso.rotation.coords;
            root["color"] = lens_json(c);
            root["color_from_depth"] = json!({
                "translation": iso.translation.vector.as_slice(),
                "rotation": [q.x, q.y, q.z, q.w],
            });
        }
        if self.color_time_offset_s != 0.0 {
            root["color_time_offset_s"] = json!(self.color_time_offset_s);
        }
        format!("{root:#}\n")
    }
}

fn lens_json(lens: &Lens) -> Value {
    let k = &lens.intrinsics;
    let mut out = json!({"width": k.width, "height": k.height, "fx": k.fx, "fy": k.fy, "cx": k.cx, "cy": k.cy});
    if !lens.distortion.is_none() {
        let ([k1, k2, k3, k4, k5, k6], [p1, p2]) =
            (lens.distortion.radial, lens.distortion.tangential);
        out["distortion"] = json!([k1, k2, p1, p2, k3, k4, k5, k6]);
    }
    out
}

/// Units per metre. Numbers below one are metres per unit, as librealsense states it (0.001 for millimetres).
fn depth_scale(path: &Path, map: &Map<String, Value>) -> Result<f64, FormatError> {
    const FIELD: &str = "depth_scale";
    let stated = match map.get(FIELD) {
        None => DEFAULT_SCALE,
        Some(v) => number(path, FIELD, v)?,
    };
    if stated.is_finite() && stated >= COARSEST {
        return Ok(stated);
    }
    if stated > 0.0 && stated <= 1.0 / COARSEST && (1.0 / stated).is_finite() {
        return Ok(1.0 / stated);
    }
    let why = format!(
        "{stated}, expected units per metre (1000 for millimetres) or metres per unit (0.001)"
    );
    Err(FormatError::field(path, FIELD, why))
}

fn time_offset(path: &Path, map: &Map<String, Value>) -> Result<f64, FormatError> {
    const FIELD: &str = "color_time_offset_s";
    let stated = match map.get(FIELD) {
        None | Some(Value::Null) => return Ok(0.0),
        Some(v) => number(path, FIELD, v)?,
    };
    if stated.abs() <= MAX_TIME_OFFSET {
        return Ok(stated);
    }
    let why = format!("{stated}, expected at most {MAX_TIME_OFFSET} s");
    Err(FormatError::field(path, FIELD, why))
}

fn color_from_depth(
    path: &Path,
    map: &Map<String, Value>,
) -> Result<Rigid<ColorCamera, Camera>, FormatError> {
    let v = match map.get("color_from_depth") {
        None | Some(Value::Null) => return Ok(Rigid::identity()),
        Some(v) => v,
    };
    let t: [f64; 3] = numbers(path, "color_from_depth.translation", v.get("translation"))?;
    let q: [f64; 4] = numbers(path, "color_from_depth.rotation", v.get("rotation"))?;
    let q = Quaternion::new(q[3], q[0], q[1], q[2]);
    if (q.norm() - 1.0).abs() > UNIT_TOLERANCE {
        let why = format!("length {}, expected a unit quaternion x, y, z, w", q.norm());
        return Err(FormatError::field(path, "color_from_depth.rotation", why));
    }
    let rotation = UnitQuaternion::from_quaternion(q);
    Ok(Rigid::from_parts(Vector3::from(t), rotation))
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

fn lens(path: &Path, prefix: &str, map: &Map<String, Value>) -> Result<Lens, FormatError> {
    Ok(Lens {
        intrinsics: intrinsics(path, prefix, map)?,
        distortion: distortion(path, prefix, map)?,
    })
}

fn distortion(
    path: &Path,
    prefix: &str,
    map: &Map<String, Value>,
) -> Result<Distortion, FormatError> {
    let field = format!("{prefix}distortion");
    let list = match map.get("distortion") {
        None | Some(Value::Null) => return Ok(Distortion::default()),
        Some(Value::Array(list)) => list,
        Some(_) => return Err(FormatError::field(path, field, "expected an array")),
    };
    let coefficients: Vec<f64> = list
        .iter()
        .map(|v| number(path, &field, v))
        .collect::<Result<_, _>>()?;
    Distortion::from_opencv(&coefficients)
        .map_err(|e| FormatError::field(path, field, e.to_string()))
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
    if k.fy < 0.0 && k.fx > 0.0 {
        let why = format!(
            "{}: negative as ICL-NUIM states it, whose y axis points up; rows point down here, write {}",
            k.fy, -k.fy
        );
        return Err(FormatError::field(path, format!("{prefix}fy"), why));
    }
    k.validated().map_err(|e| {
        FormatError::field(
            path,
            format!("{prefix}{}", e.field),
            format!("{}, expected {}", e.value, e.why),
        )
    })
}
