//! Measurements of a body for choosing sizes: girths as a tape measures them, lengths between joints.

use super::{RestBody, Template};
use crate::math::{P3, P3d, V3d};
use crate::mesh::Face;
use nalgebra::{Point2, Vector3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Sizes of a person in the rest pose, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measurements {
    /// Sole to crown.
    pub stature: f64,
    /// Around the fullest part of the chest below the armpits.
    pub chest: f64,
    /// Around the trunk at the height of the navel (ANSUR's waist).
    pub waist: f64,
    /// Around the narrowest part of the trunk between seat and lower chest (the waist of clothes' size tables).
    pub natural_waist: f64,
    /// Around the fullest part of the seat.
    pub hip: f64,
    /// Around the middle of the neck, across its axis.
    pub neck: f64,
    /// Around the upper thigh, level.
    pub thigh: f64,
    /// Around the fullest part of the calf, level.
    pub calf: f64,
    /// Around the middle of the upper arm, across its axis.
    pub upper_arm: f64,
    /// Around the wrist, across the forearm.
    pub wrist: f64,
    /// Between the tops of the shoulders (about biacromial breadth).
    pub shoulder_width: f64,
    /// Crotch to floor.
    pub inseam: f64,
    /// Shoulder joint to wrist joint along the arm.
    pub arm_length: f64,
    /// Neck joint to the height of the hip joints.
    pub torso_length: f64,
}

/// A body that cannot be measured.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeasureError {
    /// The skeleton lacks a joint that landmarks hang on.
    #[error("measurements need joint `{0}`, which the skeleton lacks")]
    Joint(&'static str),
    /// The surface does not close around a place to be measured.
    #[error("the surface has no closed section at the {0}")]
    Section(&'static str),
}

/// Navel between hip joints (0) and neck joint (1): omphalion 1.017 m at a stature of 1.692 m, ANSUR II means.
const NAVEL: f64 = 0.24;
/// Where the narrowest part of the trunk can be, in the same measure.
const WAIST_BETWEEN: [f64; 2] = [0.16, 0.5];
/// The acromion lies above and a little outside the shoulder joint, 30° from the vertical (tangent).
const ACROMION_LEAN: f64 = 0.577;
/// Distance of slices where a maximum or an end is looked for, metres. Girths change by less than 1 mm in between.
const SLICE: f64 = 0.006;

/// Halvings of [`SLICE`] to find the crotch within a tenth of a millimetre.
const HALVINGS: usize = 6;

/// Closed outlines where a plane cuts the surface, in coordinates (u, v) of the plane around its `origin`.
#[derive(Clone, Debug)]
pub struct Section {
    /// Points of each closed outline, in order.
    pub outlines: Vec<Vec<Point2<f64>>>,
}

/// Cuts a surface with the plane through `origin` with unit `normal`; `u` (in the plane) gives the first coordinate,
/// `normal × u` the second. Outlines that do not close are left out.
pub fn section(vertices: &[P3], faces: &[Face], origin: &P3d, normal: &V3d, u: &V3d) -> Section {
    let v = normal.cross(u);
    let side = |p: &P3| (p.cast::<f64>() - origin).dot(normal);
    // Each cut face leads from the edge where the outline enters to the one where it leaves.
    let mut next: BTreeMap<(u32, u32), (u32, u32)> = BTreeMap::new();
    for f in faces {
        let above = f.map(|i| side(&vertices[i as usize]) >= 0.0);
        if above[0] == above[1] && above[1] == above[2] {
            continue;
        }
        let key = |k: usize| {
            let (a, b) = (f[k], f[(k + 1) % 3]);
            (a.min(b), a.max(b))
        };
        let down = (0..3).find(|&k| above[k] && !above[(k + 1) % 3]);
        let up = (0..3).find(|&k| !above[k] && above[(k + 1) % 3]);
        if let (Some(d), Some(u)) = (down, up) {
            next.insert(key(d), key(u));
        }
    }
    let point = |(a, b): (u32, u32)| {
        let (p, q) = (
            vertices[a as usize].cast::<f64>(),
            vertices[b as usize].cast::<f64>(),
        );
        let (da, db) = ((p - origin).dot(normal), (q - origin).dot(normal));
        let x = p + (q - p) * (da / (da - db)) - origin;
        Point2::new(x.dot(u), x.dot(&v))
    };
    let mut outlines = Vec::new();
    while let Some((&first, _)) = next.iter().next() {
        let (mut at, mut outline) = (first, Vec::new());
        while let Some(to) = next.remove(&at) {
            outline.push(point(at));
            at = to;
        }
        if at == first && outline.len() > 2 {
            outlines.push(outline);
        }
    }
    Section { outlines }
}

impl Section {
    /// The outline around (u, v) = 0, or else the one whose middle is nearest to it.
    fn central(&self) -> Option<&Vec<Point2<f64>>> {
        let off = |o: &Vec<Point2<f64>>| {
            let sum = o
                .iter()
                .fold(nalgebra::Vector2::zeros(), |s, p| s + p.coords);
            sum.norm() / o.len() as f64
        };
        self.outlines
            .iter()
            .min_by(|a, b| off(a).total_cmp(&off(b)))
    }
    /// As a tape around the central outline: the length of its convex hull.
    pub fn girth(&self) -> Option<f64> {
        self.central().map(|o| hull_length(o))
    }
}

/// Length of the convex hull of points in the plane (monotone chain).
fn hull_length(points: &[Point2<f64>]) -> f64 {
    let mut p = points.to_vec();
    p.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let chain = |it: &mut dyn Iterator<Item = &Point2<f64>>| {
        let mut h: Vec<Point2<f64>> = Vec::new();
        for q in it {
            while let [.., a, b] = h.as_slice() {
                if (b - a).perp(&(q - b)) > 0.0 {
                    break;
                }
                h.pop();
            }
            h.push(*q);
        }
        h.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>()
    };
    chain(&mut p.iter()) + chain(&mut p.iter().rev())
}

/// Faces by the height they span, so that a level cut looks at a few hundred of them.
struct Levels<'a> {
    vertices: &'a [P3],
    low: f64,
    /// Faces that reach into each slab of [`SLICE`] metres.
    slabs: Vec<Vec<Face>>,
}

impl<'a> Levels<'a> {
    fn new(vertices: &'a [P3], faces: &[Face], low: f64, high: f64) -> Self {
        let slab = |y: f64| ((y - low) / SLICE).max(0.0) as usize;
        let mut slabs = vec![Vec::new(); slab(high) + 1];
        for f in faces {
            let y = f.map(|i| f64::from(vertices[i as usize].y));
            let (a, b) = (y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2]));
            slabs[slab(a)..=slab(b)].iter_mut().for_each(|s| s.push(*f));
        }
        Self {
            vertices,
            low,
            slabs,
        }
    }
    fn cut(&self, origin: P3d) -> Section {
        let k = ((origin.y - self.low) / SLICE).floor();
        let faces = if k < 0.0 {
            None
        } else {
            self.slabs.get(k as usize)
        };
        section(
            self.vertices,
            faces.map_or(&[], Vec::as_slice),
            &origin,
            &V3d::y(),
            &V3d::x(),
        )
    }
}

/// Takes the measurements of `body`, a shape of `template`, in the rest pose (upright, arms away from the trunk).
///
/// # Errors
/// Names the joint or the section that is missing.
pub fn measure(template: &Template, body: &RestBody) -> Result<Measurements, MeasureError> {
    let joint = |name: &'static str| {
        template
            .skeleton()
            .index(name)
            .map(|j| body.joints[j])
            .ok_or(MeasureError::Joint(name))
    };
    let (v, faces) = (body.vertices.as_slice(), template.mesh().faces());
    let (hip, knee, ankle) = (
        joint("left_hip")?,
        joint("left_knee")?,
        joint("left_ankle")?,
    );
    let (shoulder, elbow, wrist) = (
        joint("left_shoulder")?,
        joint("left_elbow")?,
        joint("left_wrist")?,
    );
    let (neck, head) = (joint("neck")?, joint("head")?);
    let right_shoulder = joint("right_shoulder")?;
    let middle = nalgebra::center(&hip, &joint("right_hip")?);
    let (low, high) = v
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| {
            (l.min(f64::from(p.y)), h.max(f64::from(p.y)))
        });
    let levels = Levels::new(v, faces, low, high);
    let level = |p: P3d| levels.cut(p);
    let across = |a: &P3d, b: &P3d, t: f64| {
        let n = (b - a).normalize();
        let u = n
            .cross(&V3d::z())
            .try_normalize(f64::EPSILON)
            .unwrap_or_else(Vector3::x);
        section(v, faces, &(a + (b - a) * t), &n, &u)
    };
    // The trunk at a height, and the largest girth between two heights.
    let trunk = |y: f64| level(P3d::new(middle.x, y, middle.z));
    let steps = |from: f64, to: f64| {
        let n = ((to - from).abs() / SLICE).ceil().max(1.0) as usize;
        (0..=n).map(move |k| from + (to - from) * k as f64 / n as f64)
    };
    let missing = |what: &'static str| move || MeasureError::Section(what);
    let straddles = |s: &Section| {
        s.central()
            .is_some_and(|o| o.iter().any(|p| p.x < 0.0) && o.iter().any(|p| p.x > 0.0))
    };
    let below = steps(hip.y, knee.y)
        .find(|&y| !straddles(&trunk(y)))
        .ok_or_else(missing("crotch"))?;
    let crotch = (0..HALVINGS)
        .fold([below, below + SLICE], |[l, h], _| {
            let m = 0.5 * (l + h);
            if straddles(&trunk(m)) { [l, m] } else { [m, h] }
        })
        .iter()
        .sum::<f64>()
        * 0.5;
    // Under the armpit the trunk is apart from the arms: its outline ends inside the shoulder joints' breadth.
    let apart = |s: &Section| {
        s.central()
            .is_some_and(|o| o.iter().all(|p| p.x.abs() < 1.25 * (shoulder.x - middle.x)))
    };
    let lower_chest = middle.y + 0.55 * (neck.y - middle.y);
    let chest = steps(lower_chest, shoulder.y)
        .map(trunk)
        .take_while(apart)
        .filter_map(|s| s.girth())
        .fold(0.0, f64::max);
    let waist = trunk(middle.y + NAVEL * (neck.y - middle.y))
        .girth()
        .ok_or_else(missing("waist"))?;
    let natural = steps(
        middle.y + WAIST_BETWEEN[0] * (neck.y - middle.y),
        middle.y + WAIST_BETWEEN[1] * (neck.y - middle.y),
    )
    .filter_map(|y| trunk(y).girth())
    .fold(waist, f64::min);
    let seat = steps(crotch + 2.0 * SLICE, middle.y + 0.06)
        .map(trunk)
        .filter_map(|s| s.girth())
        .fold(0.0, f64::max);
    let leg = |y: f64| {
        let t = ((hip.y - y) / (hip.y - knee.y)).clamp(0.0, 1.0);
        let x = if y > knee.y {
            hip + (knee - hip) * t
        } else {
            knee + (ankle - knee) * ((knee.y - y) / (knee.y - ankle.y))
        };
        level(P3d::new(x.x, y, x.z))
    };
    let thigh = leg(crotch - 0.02).girth().ok_or_else(missing("thigh"))?;
    let calf = steps(knee.y - 0.05, ankle.y + 0.1)
        .filter_map(|y| leg(y).girth())
        .fold(0.0, f64::max);
    let neck_girth = [0.35, 0.5, 0.65]
        .iter()
        .filter_map(|&t| across(&neck, &head, t).girth())
        .fold(f64::INFINITY, f64::min);
    if !neck_girth.is_finite() {
        return Err(MeasureError::Section("neck"));
    }
    let acromion = |j: &P3d, out: f64| {
        let d = V3d::new(out * ACROMION_LEAN, 1.0, 0.0).normalize();
        farthest_along(v, faces, j, &d).map(|t| j + d * t)
    };
    let (a, b) = (acromion(&shoulder, 1.0), acromion(&right_shoulder, -1.0));
    let (Some(a), Some(b)) = (a, b) else {
        return Err(MeasureError::Section("shoulder"));
    };
    Ok(Measurements {
        stature: high - low,
        chest: if chest > 0.0 {
            chest
        } else {
            return Err(MeasureError::Section("chest"));
        },
        waist,
        natural_waist: natural,
        hip: seat,
        neck: neck_girth,
        thigh,
        calf,
        upper_arm: across(&shoulder, &elbow, 0.55)
            .girth()
            .ok_or_else(missing("upper arm"))?,
        wrist: across(&elbow, &wrist, 0.97)
            .girth()
            .ok_or_else(missing("wrist"))?,
        shoulder_width: (a - b).norm(),
        inseam: crotch - low,
        arm_length: (elbow - shoulder).norm() + (wrist - elbow).norm(),
        torso_length: neck.y - middle.y,
    })
}

/// Where a ray from inside leaves the surface for the first time, metres along the unit direction.
fn farthest_along(vertices: &[P3], faces: &[Face], from: &P3d, direction: &V3d) -> Option<f64> {
    let mut nearest: Option<f64> = None;
    for f in faces {
        let [a, b, c] = f.map(|i| vertices[i as usize].cast::<f64>());
        let (e1, e2) = (b - a, c - a);
        let h = direction.cross(&e2);
        let det = e1.dot(&h);
        if det.abs() < f64::MIN_POSITIVE {
            continue;
        }
        let s = from - a;
        let (u, q) = (s.dot(&h) / det, s.cross(&e1));
        let (w, t) = (direction.dot(&q) / det, e2.dot(&q) / det);
        if u >= 0.0 && w >= 0.0 && u + w <= 1.0 && t > 0.0 && nearest.is_none_or(|n| t < n) {
            nearest = Some(t);
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A closed cylinder of radius 0.2 m about the y axis, `n` sides, height 0 to 1 m.
    fn cylinder(n: u32) -> (Vec<P3>, Vec<Face>) {
        let mut v = Vec::new();
        for y in [0.0f32, 1.0] {
            for k in 0..n {
                let a = 2.0 * std::f32::consts::PI * k as f32 / n as f32;
                v.push(P3::new(0.2 * a.cos(), y, 0.2 * a.sin()));
            }
        }
        let f = (0..n).flat_map(|k| {
            let l = (k + 1) % n;
            [[k, n + k, l], [l, n + k, n + l]]
        });
        (v, f.collect())
    }

    #[test]
    fn girth_of_a_cylinder_level_and_oblique() {
        let (v, f) = cylinder(256);
        let level = section(&v, &f, &P3d::new(0.0, 0.4, 0.0), &V3d::y(), &V3d::x());
        assert_eq!(level.outlines.len(), 1);
        let girth = level.girth().expect("closed");
        assert!((girth - 0.4 * PI).abs() < 2e-4, "{girth}");
        // 45°: an ellipse with half axes r and r√2; Ramanujan's second formula.
        let n = V3d::new(0.0, 1.0, 1.0).normalize();
        let girth = section(&v, &f, &P3d::new(0.0, 0.5, 0.0), &n, &V3d::x())
            .girth()
            .expect("closed");
        let (a, b) = (0.2 * 2f64.sqrt(), 0.2);
        let h = ((a - b) / (a + b)).powi(2);
        let expected = PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
        assert!(
            (girth - expected).abs() < 3e-4,
            "{girth} against {expected}"
        );
        assert!(
            section(&v, &f, &P3d::new(0.0, 2.0, 0.0), &V3d::y(), &V3d::x())
                .girth()
                .is_none()
        );
    }

    #[test]
    fn a_tape_bridges_hollows() {
        // An L: the hull cuts the corner.
        let l = [
            [0.0, 0.0],
            [2.0, 0.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [0.0, 2.0],
        ]
        .map(Point2::from);
        assert!((hull_length(&l) - (6.0 + 2f64.sqrt())).abs() < 1e-12);
    }

    #[test]
    fn rays_leave_where_they_should() {
        let (v, f) = cylinder(256);
        let t = farthest_along(&v, &f, &P3d::new(0.0, 0.5, 0.0), &V3d::x());
        assert!((t.expect("hit") - 0.2).abs() < 1e-4);
        assert_eq!(
            farthest_along(&v, &f, &P3d::new(0.0, 0.5, 0.0), &V3d::y()),
            None
        );
    }
}
