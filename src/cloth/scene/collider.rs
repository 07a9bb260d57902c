//! Spheres and capsules that move as samples or not at all.

use crate::math::V3d;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::Deserialize;
use std::path::Path;

/// A convex solid around the origin of its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Primitive {
    /// Ball of this radius, metres.
    Sphere {
        /// Metres.
        radius: f64,
    },
    /// Ball swept along the frame's y axis.
    Capsule {
        /// Metres.
        radius: f64,
        /// Half the length of the axis, metres.
        half_segment: f64,
    },
}

impl Primitive {
    /// No point of it comes further than this from one placement to another, metres.
    pub fn fastest(&self, from: &Isometry3<f64>, to: &Isometry3<f64>) -> f64 {
        let size = match self {
            Self::Sphere { radius } => *radius,
            Self::Capsule {
                radius,
                half_segment,
            } => radius + half_segment,
        };
        let turn = from.rotation.angle_to(&to.rotation);
        (from.translation.vector - to.translation.vector).norm() + turn * size
    }
    /// Signed distance (metres, negative inside) and outward normal at a point of the solid's frame.
    pub fn distance(&self, p: &V3d) -> (f64, V3d) {
        let (radius, axis_point) = match self {
            Self::Sphere { radius } => (*radius, V3d::zeros()),
            Self::Capsule {
                radius,
                half_segment,
            } => (
                *radius,
                V3d::new(0.0, p.y.clamp(-half_segment, *half_segment), 0.0),
            ),
        };
        let d = p - axis_point;
        let n = d.norm();
        // On the axis every direction is as near; one is taken.
        let normal = if n > 0.0 { d / n } else { V3d::x() };
        (n - radius, normal)
    }
}

/// A solid with its motion.
#[derive(Clone, Debug)]
pub struct Collider {
    /// Its shape.
    pub shape: Primitive,
    /// Coulomb coefficient.
    pub friction: f64,
    /// Time (s) and placement, in order; one entry stands still.
    pub motion: Vec<(f64, Isometry3<f64>)>,
}

#[derive(Deserialize)]
pub(super) struct FileCollider {
    #[serde(rename = "type")]
    kind: String,
    radius: f64,
    #[serde(default)]
    half_segment: f64,
    #[serde(default)]
    center: [f64; 3],
    #[serde(default)]
    friction: f64,
    /// File name, maybe followed by words about its columns.
    #[serde(default)]
    motion_csv: Option<String>,
    /// The same rows here: t, position, quaternion x y z w.
    #[serde(default)]
    motion: Vec<[f64; 8]>,
}

impl Collider {
    pub(super) fn read(c: &FileCollider, folder: Option<&Path>) -> Result<Self, String> {
        if !(c.radius > 0.0 && c.radius.is_finite()) {
            return Err(format!("radius: {} is no positive length", c.radius));
        }
        if !(c.friction >= 0.0 && c.friction.is_finite()) {
            return Err(format!("friction: {} is no coefficient", c.friction));
        }
        let shape = match c.kind.as_str() {
            "sphere" => Primitive::Sphere { radius: c.radius },
            "capsule" if c.half_segment >= 0.0 => Primitive::Capsule {
                radius: c.radius,
                half_segment: c.half_segment,
            },
            "capsule" => return Err(format!("half_segment: {} is negative", c.half_segment)),
            other => {
                return Err(format!(
                    "type: `{other}` is not known; there are sphere and capsule"
                ));
            }
        };
        let motion = match (
            c.motion_csv
                .as_deref()
                .and_then(|m| m.split_whitespace().next()),
            folder,
        ) {
            (None, _) if c.motion.is_empty() => {
                vec![(
                    0.0,
                    Isometry3::from_parts(
                        Translation3::from(V3d::from(c.center)),
                        UnitQuaternion::identity(),
                    ),
                )]
            }
            (None, _) => {
                placements(&c.motion).map_err(|(row, why)| format!("motion[{row}]: {why}"))?
            }
            (Some(name), Some(folder)) => read_motion(&folder.join(name))?,
            (Some(_), None) => return Err("motion_csv: no files are read here: use motion".into()),
        };
        Ok(Self {
            shape,
            friction: c.friction,
            motion,
        })
    }
    /// Where it is at time `t`, s; between samples by interpolation, beyond them as at the ends.
    pub fn placement(&self, t: f64) -> Isometry3<f64> {
        let after = self.motion.partition_point(|(time, _)| *time <= t);
        match (
            after.checked_sub(1).map(|i| &self.motion[i]),
            self.motion.get(after),
        ) {
            (Some((t0, a)), Some((t1, b))) => {
                let s = (t - t0) / (t1 - t0);
                a.try_lerp_slerp(b, s, f64::EPSILON).unwrap_or(*a)
            }
            (Some((_, a)), None) | (None, Some((_, a))) => *a,
            (None, None) => Isometry3::identity(),
        }
    }
}

/// t, position, quaternion x y z w; one header line.
fn read_motion(path: &Path) -> Result<Vec<(f64, Isometry3<f64>)>, String> {
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

/// Times (s) and placements, in order.
type Motion = Vec<(f64, Isometry3<f64>)>;

/// Times and placements of rows, or the row at fault.
fn placements(rows: &[[f64; 8]]) -> Result<Motion, (usize, &'static str)> {
    let mut out: Motion = Vec::with_capacity(rows.len());
    for (row, v) in rows.iter().enumerate() {
        let [t, px, py, pz, qx, qy, qz, qw] = *v;
        if !v.iter().all(|x| x.is_finite()) || out.last().is_some_and(|(last, _)| *last >= t) {
            return Err((row, "times must rise and all numbers be finite"));
        }
        let q = UnitQuaternion::try_new(Quaternion::new(qw, qx, qy, qz), 1e-6)
            .ok_or((row, "no rotation"))?;
        out.push((t, Isometry3::from_parts(Translation3::new(px, py, pz), q)));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_have_their_closed_form() {
        let c = Primitive::Capsule {
            radius: 0.1,
            half_segment: 0.4,
        };
        let (d, n) = c.distance(&V3d::new(0.3, 0.2, 0.0));
        assert!((d - 0.2).abs() < 1e-12 && (n - V3d::x()).norm() < 1e-12);
        let (d, n) = c.distance(&V3d::new(0.0, 0.9, 0.0));
        assert!((d - 0.4).abs() < 1e-12 && (n - V3d::y()).norm() < 1e-12);
        assert!((c.distance(&V3d::zeros()).0 + 0.1).abs() < 1e-12);
        assert!(c.distance(&V3d::zeros()).1.norm() > 0.99);
    }

    #[test]
    fn motion_is_interpolated_and_held_at_its_ends() {
        let at = |x: f64| Isometry3::translation(x, 0.0, 0.0);
        let c = Collider {
            shape: Primitive::Sphere { radius: 1.0 },
            friction: 0.0,
            motion: vec![(0.0, at(0.0)), (1.0, at(2.0))],
        };
        for (t, x) in [(-1.0, 0.0), (0.25, 0.5), (1.0, 2.0), (9.0, 2.0)] {
            assert!((c.placement(t).translation.x - x).abs() < 1e-12, "t = {t}");
        }
    }
}
