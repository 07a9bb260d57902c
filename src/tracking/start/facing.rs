//! Facing of the person: yaw about gravity from the votes of the part forest.

use crate::model::{PartClasses, PartKind};
use crate::segment::part_forest::{PersonCells, YAW_BINS, YawBelief};
use std::f32::consts::{FRAC_PI_4, TAU};
use tryon_body::parts::BodySide;
use tryon_geometry::math::{P3d, V3, V3d};

/// Least length of the level part of a unit direction from which it gives a yaw.
const LEVEL: f64 = 0.05;

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

/// Level directions at a place: towards the camera, and to its left hand of the subject who faces it.
fn level_axes(place: &V3d, up: &V3d) -> Option<[V3d; 2]> {
    let level = -(place - up * up.dot(place));
    let to_camera = level.try_normalize(LEVEL * place.norm())?;
    Some([to_camera, up.cross(&to_camera)])
}

/// Facing of a person whose yaw the part forest has voted on. `None` without a vote or under a camera straight above.
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
    let points = person
        .cells
        .iter()
        .map(|&c| person.cloud.centre(c as usize).coords);
    let middle = points.sum::<V3>() / person.cells.len().max(1) as f32;
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
    yaw_of_trunk(pair(PartKind::Shoulder)?, pair(PartKind::Hip)?, up)
}

/// Yaw of a trunk from its shoulders and hips, left and right, camera frame, metres.
pub fn yaw_of_trunk(shoulders: [P3d; 2], hips: [P3d; 2], up: &V3) -> Option<f64> {
    let up = up.cast::<f64>();
    let across = (shoulders[0] - shoulders[1]) + (hips[0] - hips[1]);
    let level = (across - up * up.dot(&across)).try_normalize(LEVEL)?;
    let middle = nalgebra::center(&hips[0], &hips[1]);
    let [to_camera, side] = level_axes(&middle.coords, &up)?;
    let front = level.cross(&up);
    Some(front.dot(&side).atan2(front.dot(&to_camera)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn yaw_of_known_trunks() {
        let up = V3::new(0.0, -1.0, 0.0);
        // A subject 2 m away who faces the camera has the left side at the image's right.
        let trunk = |left: V3d| {
            let at = |k: f64, y: f64| P3d::new(0.0, y, 2.0) + left * k;
            yaw_of_trunk(
                [at(0.2, -0.4), at(-0.2, -0.4)],
                [at(0.1, 0.0), at(-0.1, 0.0)],
                &up,
            )
        };
        assert!(trunk(V3d::x()).is_some_and(|y| y.abs() < 1e-12));
        assert!(trunk(-V3d::x()).is_some_and(|y| (y.abs() - PI).abs() < 1e-12));
        // Turned to the subject's left: the front points to the image's right.
        assert!(trunk(V3d::z()).is_some_and(|y| (y - FRAC_PI_2).abs() < 1e-12));
        assert_eq!(trunk(V3d::y()), None);
    }
}
