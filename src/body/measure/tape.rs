//! Girths around a body and lengths between its joints.

use super::section::{LevelSlabs, SLICE, Section, first_exit, section};
use crate::settings::TapeSettings;
use crate::{RestBody, Template};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::{P3d, V3d};

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

/// Halvings of [`SLICE`] to find the crotch within a tenth of a millimetre.
const HALVINGS: usize = 6;

/// Joints that landmarks hang on, metres.
struct MeasureLandmarks {
    hip: P3d,
    knee: P3d,
    ankle: P3d,
    shoulder: P3d,
    right_shoulder: P3d,
    elbow: P3d,
    wrist: P3d,
    neck: P3d,
    head: P3d,
    /// Middle between the hip joints.
    middle: P3d,
}

impl MeasureLandmarks {
    fn new(template: &Template, body: &RestBody) -> Result<Self, MeasureError> {
        let joint = |name: &'static str| {
            let index = template.skeleton().index(name);
            index
                .map(|j| body.joints[j])
                .ok_or(MeasureError::Joint(name))
        };
        let hip = joint("left_hip")?;
        Ok(Self {
            hip,
            knee: joint("left_knee")?,
            ankle: joint("left_ankle")?,
            shoulder: joint("left_shoulder")?,
            right_shoulder: joint("right_shoulder")?,
            elbow: joint("left_elbow")?,
            wrist: joint("left_wrist")?,
            neck: joint("neck")?,
            head: joint("head")?,
            middle: nalgebra::center(&hip, &joint("right_hip")?),
        })
    }
    /// Height between the hip joints (0) and the neck joint (1), metres.
    fn trunk_height(&self, share: f64) -> f64 {
        self.middle.y + share * (self.neck.y - self.middle.y)
    }
}

/// A body under the tape.
struct Tape<'a> {
    template: &'a Template,
    body: &'a RestBody,
    settings: TapeSettings,
    levels: LevelSlabs<'a>,
    at: MeasureLandmarks,
}

/// Heights from one to the other, at most [`SLICE`] apart.
fn heights(from: f64, to: f64) -> impl Iterator<Item = f64> {
    let n = ((to - from).abs() / SLICE).ceil().max(1.0) as usize;
    (0..=n).map(move |k| from + (to - from) * k as f64 / n as f64)
}

/// The central outline lies on both sides of the middle: legs have joined.
fn straddles_middle(s: &Section) -> bool {
    s.central()
        .is_some_and(|o| o.iter().any(|p| p.x < 0.0) && o.iter().any(|p| p.x > 0.0))
}

impl Tape<'_> {
    /// Level section of the trunk.
    fn trunk(&self, y: f64) -> Section {
        let middle = self.at.middle;
        self.levels.cut(P3d::new(middle.x, y, middle.z))
    }
    /// Level section of the left leg.
    fn leg(&self, y: f64) -> Section {
        let MeasureLandmarks {
            hip, knee, ankle, ..
        } = self.at;
        let t = ((hip.y - y) / (hip.y - knee.y)).clamp(0.0, 1.0);
        let x = if y > knee.y {
            hip + (knee - hip) * t
        } else {
            knee + (ankle - knee) * ((knee.y - y) / (knee.y - ankle.y))
        };
        self.levels.cut(P3d::new(x.x, y, x.z))
    }
    /// Girth across the bone from `a` to `b` at a share of its length.
    fn across(&self, a: &P3d, b: &P3d, share: f64) -> Option<f64> {
        let n = (b - a).normalize();
        let u = n.cross(&V3d::z()).try_normalize(f64::EPSILON);
        let (origin, u) = (a + (b - a) * share, u.unwrap_or_else(Vector3::x));
        let faces = self.template.mesh().faces();
        section(&self.body.vertices, faces, &origin, &n, &u).girth()
    }
    /// Height of the crotch, between levels where legs are joined and apart.
    fn crotch(&self) -> Option<f64> {
        let joined = |y: f64| straddles_middle(&self.trunk(y));
        let below = heights(self.at.hip.y, self.at.knee.y).find(|&y| !joined(y))?;
        let [low, high] = (0..HALVINGS).fold([below, below + SLICE], |[l, h], _| {
            let m = 0.5 * (l + h);
            if joined(m) { [l, m] } else { [m, h] }
        });
        Some((low + high) * 0.5)
    }
    /// Largest girth of the chest, from below up to where the arms join.
    fn chest(&self) -> Option<f64> {
        let half = self.at.shoulder.x - self.at.middle.x;
        let apart = |s: &Section| {
            s.central().is_some_and(|o| {
                o.iter()
                    .all(|p| p.x.abs() < self.settings.trunk_breadth * half)
            })
        };
        heights(
            self.at.trunk_height(self.settings.lower_chest),
            self.at.shoulder.y,
        )
        .map(|y| self.trunk(y))
        .take_while(apart)
        .filter_map(|s| s.girth())
        .reduce(f64::max)
    }
    /// Smallest girth of the trunk between seat and chest, at most `waist`.
    fn natural_waist(&self, waist: f64) -> f64 {
        let [low, high] = self.settings.waist_between.map(|t| self.at.trunk_height(t));
        heights(low, high)
            .filter_map(|y| self.trunk(y).girth())
            .fold(waist, f64::min)
    }
    fn seat(&self, crotch: f64) -> f64 {
        heights(
            crotch + 2.0 * SLICE,
            self.at.middle.y + self.settings.seat_above,
        )
        .filter_map(|y| self.trunk(y).girth())
        .fold(0.0, f64::max)
    }
    fn calf(&self) -> f64 {
        heights(
            self.at.knee.y - self.settings.calf[0],
            self.at.ankle.y + self.settings.calf[1],
        )
        .filter_map(|y| self.leg(y).girth())
        .fold(0.0, f64::max)
    }
    fn neck(&self) -> Option<f64> {
        self.settings
            .neck
            .iter()
            .filter_map(|&t| self.across(&self.at.neck, &self.at.head, t))
            .reduce(f64::min)
    }
    /// Distance between the points of the shoulders.
    fn shoulder_width(&self) -> Option<f64> {
        let acromion = |j: &P3d, out: f64| {
            let d = V3d::new(out * self.settings.acromion_lean, 1.0, 0.0).normalize();
            let faces = self.template.mesh().faces();
            first_exit(&self.body.vertices, faces, j, &d).map(|t| j + d * t)
        };
        let left = acromion(&self.at.shoulder, 1.0)?;
        Some((left - acromion(&self.at.right_shoulder, -1.0)?).norm())
    }
}

/// Takes the measurements of `body`, a shape of `template`, in the rest pose (upright, arms away from the trunk).
///
/// # Errors
/// Names the joint or the section that is missing.
pub fn measure(template: &Template, body: &RestBody) -> Result<Measurements, MeasureError> {
    let at = MeasureLandmarks::new(template, body)?;
    let v = &body.vertices;
    let (low, high) = v
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| {
            (l.min(f64::from(p.y)), h.max(f64::from(p.y)))
        });
    let settings = TapeSettings::default();
    let tape = Tape {
        template,
        body,
        settings,
        levels: LevelSlabs::new(v, template.mesh().faces(), low, high),
        at,
    };
    let at = &tape.at;
    let missing = MeasureError::Section;
    let crotch = tape.crotch().ok_or(missing("crotch"))?;
    let waist = tape.trunk(at.trunk_height(settings.navel)).girth();
    let waist = waist.ok_or(missing("waist"))?;
    let thigh = tape.leg(crotch - settings.thigh_below).girth();
    let upper_arm = tape.across(&at.shoulder, &at.elbow, settings.biceps);
    let wrist = tape.across(&at.elbow, &at.wrist, settings.wrist);
    Ok(Measurements {
        stature: high - low,
        chest: tape.chest().ok_or(missing("chest"))?,
        waist,
        natural_waist: tape.natural_waist(waist),
        hip: tape.seat(crotch),
        neck: tape.neck().ok_or(missing("neck"))?,
        thigh: thigh.ok_or(missing("thigh"))?,
        calf: tape.calf(),
        upper_arm: upper_arm.ok_or(missing("upper arm"))?,
        wrist: wrist.ok_or(missing("wrist"))?,
        shoulder_width: tape.shoulder_width().ok_or(missing("shoulder"))?,
        inseam: crotch - low,
        arm_length: (at.elbow - at.shoulder).norm() + (at.wrist - at.elbow).norm(),
        torso_length: at.neck.y - at.middle.y,
    })
}
