//! Colliders of a scene file.

use super::{Collider, Primitive};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::Deserialize;
use std::path::Path;
use tryon_geometry::math::V3d;

/// Norm below which a quaternion is no rotation.
const SHORTEST_QUATERNION: f64 = 1e-6;

/// Times (s) and placements, in order.
type SampledMotion = Vec<(f64, Isometry3<f64>)>;

/// Collider of a scene file.
#[derive(Deserialize)]
pub(super) struct ColliderFile {
    #[serde(rename = "type")]
    kind: String,
    #[serde(default)]
    radius: Option<f64>,
    #[serde(default)]
    half_segment: f64,
    #[serde(default)]
    center: [f64; 3],
    #[serde(default)]
    friction: f64,
    /// File name, optionally followed by a description of its columns.
    #[serde(default)]
    motion_csv: Option<String>,
    /// Samples in place of a file: t, position, quaternion x y z w.
    #[serde(default)]
    motion: Vec<[f64; 8]>,
}

impl ColliderFile {
    /// Collider with its motion, which may come from a file in `folder`.
    ///
    /// # Errors
    /// Names the field, row or line at fault.
    pub(super) fn read(&self, folder: Option<&Path>) -> Result<Collider, String> {
        Ok(Collider {
            shape: self.shape()?,
            friction: self.friction,
            motion: self.placements(folder)?,
        })
    }
    fn shape(&self) -> Result<Primitive, String> {
        if !(self.friction >= 0.0 && self.friction.is_finite()) {
            return Err(format!("friction: {} is no coefficient", self.friction));
        }
        match self.kind.as_str() {
            "sphere" => Ok(Primitive::Sphere {
                radius: self.radius()?,
            }),
            "capsule" if self.half_segment >= 0.0 => Ok(Primitive::Capsule {
                radius: self.radius()?,
                half_segment: self.half_segment,
            }),
            "capsule" => Err(format!("half_segment: {} is negative", self.half_segment)),
            other => Err(format!(
                "type: `{other}` is not known; there are sphere and capsule (a floor is a sphere of a large radius)"
            )),
        }
    }
    fn radius(&self) -> Result<f64, String> {
        let radius = self.radius.ok_or("radius: missing; metres")?;
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(format!("radius: {radius} is no positive length"));
        }
        Ok(radius)
    }
    fn placements(&self, folder: Option<&Path>) -> Result<SampledMotion, String> {
        let name = self.motion_csv.as_deref();
        match (name.and_then(|m| m.split_whitespace().next()), folder) {
            (None, _) if self.motion.is_empty() => {
                let at = Translation3::from(V3d::from(self.center));
                Ok(vec![(
                    0.0,
                    Isometry3::from_parts(at, UnitQuaternion::identity()),
                )])
            }
            (None, _) => {
                placements(&self.motion).map_err(|(row, why)| format!("motion[{row}]: {why}"))
            }
            (Some(name), Some(folder)) => read_motion(&folder.join(name)),
            (Some(_), None) => Err("motion_csv: no files are read here: use motion".into()),
        }
    }
}

/// Rows of t, position, quaternion x y z w after one header line.
fn read_motion(path: &Path) -> Result<SampledMotion, String> {
    let text = std::fs::read_to_string(path)
        .map_err(|e| format!("motion_csv: {}: {e}", path.display()))?;
    let mut rows = Vec::new();
    let mut lines = Vec::new();
    for (i, line) in text
        .lines()
        .enumerate()
        .skip(1)
        .filter(|(_, l)| !l.trim().is_empty())
    {
        let fault = |why: &str| format!("motion_csv: {} line {}: {why}", path.display(), i + 1);
        let v: Vec<f64> = line
            .split(',')
            .map(|w| {
                w.trim()
                    .parse()
                    .map_err(|_| fault(&format!("`{w}` is no number")))
            })
            .collect::<Result<_, _>>()?;
        rows.push(v.try_into().map_err(|_| fault("8 numbers are needed"))?);
        lines.push(i + 1);
    }
    if rows.is_empty() {
        return Err(format!("motion_csv: {}: no samples", path.display()));
    }
    placements(&rows)
        .map_err(|(row, why)| format!("motion_csv: {} line {}: {why}", path.display(), lines[row]))
}

/// Times and placements of rows, or the row at fault.
fn placements(rows: &[[f64; 8]]) -> Result<SampledMotion, (usize, &'static str)> {
    let mut out: SampledMotion = Vec::with_capacity(rows.len());
    for (row, v) in rows.iter().enumerate() {
        let [t, px, py, pz, qx, qy, qz, qw] = *v;
        if !v.iter().all(|x| x.is_finite()) || out.last().is_some_and(|(last, _)| *last >= t) {
            return Err((row, "times must rise and all numbers be finite"));
        }
        let q = UnitQuaternion::try_new(Quaternion::new(qw, qx, qy, qz), SHORTEST_QUATERNION)
            .ok_or((row, "no rotation"))?;
        out.push((t, Isometry3::from_parts(Translation3::new(px, py, pz), q)));
    }
    Ok(out)
}
