//! Facing of the person: yaw about gravity from the belief of the part network.

use crate::model::{PartClasses, PartKind};
use crate::segment::part_network::{PersonCells, YAW_BINS, YawBelief};
use std::f32::consts::{FRAC_PI_4, TAU};
use tryon_body::parts::BodySide;
use tryon_body::{TrunkSides, level_axes};
use tryon_geometry::math::{P3d, V3};

/// Direction in which the person faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facing {
    /// Turn about `up` from facing the camera to the subject's left, radians, within ±π.
    pub yaw: f64,
    /// Unit direction of the person's front, level, camera frame.
    pub front: V3,
    /// Probability of each eighth of a turn; bin `k` is centred at a yaw of `k`·45°.
    pub belief: [f32; YAW_BINS],
    /// Belief within a quarter turn of `yaw` less the belief beyond, 0 to 1.
    pub confidence: f32,
}

/// Least belief in the opposite facing.
const LEAST_BEYOND: f32 = 0.02;

impl Facing {
    /// Odds for this facing against the opposite, 1 where undecided.
    pub(crate) fn odds(&self) -> f64 {
        let beyond = (0.5 * (1.0 - self.confidence)).max(LEAST_BEYOND);
        f64::from((1.0 - beyond) / beyond)
    }
}

/// Facing of a person whose yaw the part network has seen. `None` without a reading or under a camera straight above.
pub fn facing(person: &PersonCells<'_>, votes: &YawBelief) -> Option<Facing> {
    let belief = votes.bins;
    let most = (0..YAW_BINS).max_by(|a, b| belief[*a].total_cmp(&belief[*b]))?;
    if votes.cells == 0 {
        return None;
    }
    // Between the bins: the mean direction of the likeliest bin and its neighbours.
    let (mut x, mut y) = (0.0, 0.0);
    for k in [most + YAW_BINS - 1, most, most + 1] {
        let (s, c) = (FRAC_PI_4 * k as f32).sin_cos();
        x += belief[k % YAW_BINS] * c;
        y += belief[k % YAW_BINS] * s;
    }
    let yaw = y.atan2(x);
    let beyond: f32 = (0..YAW_BINS)
        .filter(|k| wrapped(FRAC_PI_4 * *k as f32 - yaw).abs() > 2.0 * FRAC_PI_4)
        .map(|k| belief[k])
        .sum();
    let middle = person.middle().coords;
    let [to_camera, side] = level_axes(&middle.cast(), &person.up.cast())?;
    let (s, c) = f64::from(yaw).sin_cos();
    Some(Facing {
        yaw: f64::from(yaw),
        front: (to_camera * c + side * s).cast(),
        belief,
        confidence: (1.0 - 2.0 * beyond).max(0.0),
    })
}

/// Angle within ±π.
fn wrapped(angle: f32) -> f32 {
    let a = angle.rem_euclid(TAU);
    if a > 0.5 * TAU { a - TAU } else { a }
}

/// Yaw of a posed body as in [`Facing::yaw`], from shoulders and hips; `None` for one that lies or lacks the joints.
pub fn yaw_of_joints(classes: &PartClasses, joints: &[P3d], up: &V3) -> Option<f64> {
    let pair = |kind: PartKind| {
        let at = |side| classes.anchor_of(kind.class(side), joints);
        Some([at(BodySide::Left)?, at(BodySide::Right)?])
    };
    let sides = TrunkSides {
        shoulders: Some(pair(PartKind::Shoulder)?),
        hips: Some(pair(PartKind::Hip)?),
    };
    sides.yaw(up)
}
