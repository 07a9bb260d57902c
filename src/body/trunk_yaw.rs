//! Yaw of a trunk about gravity, from the joints at its sides.

use serde::{Deserialize, Serialize};
use tryon_geometry::math::{P3d, V3, V3d};

/// Least length of the level part of a unit direction from which it gives a yaw.
const LEVEL: f64 = 0.05;

/// Joints at both sides of a trunk, each pair left before right, camera frame, metres; `None` where a pair is not known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrunkSides {
    /// Left and right shoulder.
    pub shoulders: Option<[P3d; 2]>,
    /// Left and right hip.
    pub hips: Option<[P3d; 2]>,
}

impl TrunkSides {
    /// Turn about `up`, a unit vector, from facing the camera to the subject's left, radians, within ±π.
    ///
    /// `None` without a pair, for a trunk that lies, and under a camera straight above.
    pub fn yaw(&self, up: &V3) -> Option<f64> {
        let up = up.cast::<f64>();
        let [left, right] = self.hips.or(self.shoulders)?;
        let pairs = [self.shoulders, self.hips];
        let across: V3d = pairs.iter().flatten().map(|[l, r]| l - r).sum();
        let level = (across - up * up.dot(&across)).try_normalize(LEVEL)?;
        let [to_camera, side] = level_axes(&nalgebra::center(&left, &right).coords, &up)?;
        let front = level.cross(&up);
        Some(front.dot(&side).atan2(front.dot(&to_camera)))
    }
}

/// Level directions at a place, camera frame: towards the camera, and to the left hand of a subject there who faces it.
///
/// `None` under a camera straight above.
pub fn level_axes(place: &V3d, up: &V3d) -> Option<[V3d; 2]> {
    let level = -(place - up * up.dot(place));
    let to_camera = level.try_normalize(LEVEL * place.norm())?;
    Some([to_camera, up.cross(&to_camera)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// Yaw of a subject 2 m away whose left side points along `left`.
    fn yaw(left: V3d, has: [bool; 2]) -> Option<f64> {
        let pair = |half: f64, y: f64| [half, -half].map(|k| P3d::new(0.0, y, 2.0) + left * k);
        let sides = TrunkSides {
            shoulders: has[0].then(|| pair(0.2, -0.4)),
            hips: has[1].then(|| pair(0.1, 0.0)),
        };
        sides.yaw(&V3::new(0.0, -1.0, 0.0))
    }

    #[test]
    fn yaw_of_known_trunks() {
        for has in [[true, true], [true, false], [false, true]] {
            // A subject who faces the camera has the left side at the image's right.
            assert!(yaw(V3d::x(), has).is_some_and(|y| y.abs() < 1e-12));
            assert!(yaw(-V3d::x(), has).is_some_and(|y| (y.abs() - PI).abs() < 1e-12));
            // Turned to the subject's left: the front points to the image's right.
            assert!(yaw(V3d::z(), has).is_some_and(|y| (y - FRAC_PI_2).abs() < 1e-12));
            assert_eq!(yaw(V3d::y(), has), None);
        }
        assert_eq!(yaw(V3d::x(), [false, false]), None);
    }
}
