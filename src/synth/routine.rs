//! Routines of the synthetic actor: keyframes of torso and arms, a path for the pelvis, feet that step under it.

use super::posture::Posture;
use super::settings::StanceSettings;
use super::stance::{Limb, Rig, Stance, limb};
use nalgebra::UnitQuaternion;
use tryon_geometry::math::{P3d, V3d, exp_so3};

/// Motion in front of the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Routine {
    /// Calibration pose, turns to both sides, arms up, hand on hip, side steps, head down to the shirt, one arm
    /// across the body; repeats every [`Routine::period`] seconds.
    #[default]
    TryOn,
    /// Stands, leaves the picture to the side, stays away for two seconds, comes back.
    LeaveAndReturn,
    /// Turns by 40° to the left, to the right and back, arms hanging: what a torso seen from the waist up shows least.
    Turn,
    /// Walks a figure of eight: to either side, 1.8 to 3.2 m from a camera 2.4 m away.
    Walk,
    /// Walks up to the camera, from 2 m behind the start to 0.6 m before it, and stands.
    Approach,
    /// Stands still in the calibration pose.
    Still,
    /// A posture held without breath or sway.
    Hold(Posture),
    /// An empty room.
    Empty,
}

/// One keyframe. Angles in degrees, lengths in metres.
#[derive(Clone, Copy, Debug)]
struct Key {
    /// Seconds from the start of the routine.
    t: f64,
    /// Pelvis over the floor: to the person's left at yaw 0, and towards the camera.
    place: [f64; 2],
    /// Turn of the whole body to its left.
    yaw: f64,
    /// Chest: bend forward, twist to the left, lean to the left.
    chest: [f64; 3],
    /// Head: nod down, turn to the left.
    head: [f64; 2],
    /// Arms as if both were left: x outward, y up, z forward.
    arms: [Limb; 2],
}

const fn v(x: f64, y: f64, z: f64) -> V3d {
    V3d::new(x, y, z)
}

/// The calibration pose: arms 45° down with elbows almost straight.
const A: Limb = limb([0.72, -0.69, 0.0], [0.68, -0.7, 0.18], [0.66, -0.7, 0.18]);
/// Hanging loosely, clear of the hips.
const DOWN: Limb = limb(
    [0.34, -0.93, -0.06],
    [0.24, -0.93, 0.24],
    [0.12, -0.95, 0.26],
);
/// Straight out to the side.
const SIDE: Limb = limb([0.99, -0.02, 0.04], [0.97, 0.02, 0.22], [0.98, 0.0, 0.18]);
/// Up and out.
const UP: Limb = limb([0.62, 0.76, 0.12], [0.4, 0.88, 0.22], [0.36, 0.92, 0.14]);
/// Hand on the hip, elbow out.
const HIP: Limb = limb(
    [0.66, -0.72, -0.22],
    [-0.52, -0.64, 0.56],
    [-0.25, -0.55, 0.79],
);
/// Forearm across the belly, a hand's breadth in front of it.
const ACROSS: Limb = limb([0.26, -0.88, 0.4], [-0.72, 0.16, 0.67], [-0.97, 0.16, 0.16]);
/// Hand at the hem of the shirt.
const HEM: Limb = limb(
    [0.44, -0.88, -0.1],
    [-0.3, -0.66, 0.68],
    [-0.4, -0.84, 0.36],
);

/// Turn of the body and posture of chest and head.
#[derive(Clone, Copy)]
struct Torso {
    yaw: f64,
    chest: [f64; 3],
    head: [f64; 2],
}

const fn torso(yaw: f64, chest: [f64; 3], head: [f64; 2]) -> Torso {
    Torso { yaw, chest, head }
}

const fn turned(yaw: f64) -> Torso {
    torso(yaw, [0.0; 3], [0.0; 2])
}

const fn key(t: f64, torso: Torso, arms: [Limb; 2]) -> Key {
    key_at(t, [0.0; 2], torso, arms)
}

const fn key_at(t: f64, place: [f64; 2], torso: Torso, arms: [Limb; 2]) -> Key {
    let Torso { yaw, chest, head } = torso;
    Key {
        t,
        place,
        yaw,
        chest,
        head,
        arms,
    }
}

const FRONT: Torso = turned(0.0);
const LEFT: Torso = torso(22.0, [0.0, 16.0, 0.0], [4.0, 8.0]);
const RIGHT: Torso = torso(-22.0, [0.0, -16.0, 0.0], [4.0, -8.0]);
const BACK_BENT: Torso = torso(0.0, [-3.0, 0.0, 0.0], [-6.0, 0.0]);
const HIP_RIGHT: Torso = torso(0.0, [0.0, -4.0, 4.0], [0.0, 6.0]);
const HIP_LEFT: Torso = torso(12.0, [0.0, 4.0, 4.0], [0.0, -6.0]);
const HEAD_DOWN: Torso = torso(0.0, [10.0, 0.0, 0.0], [32.0, 0.0]);
const HEAD_DOWN_LEFT: Torso = torso(0.0, [10.0, 4.0, 0.0], [30.0, 5.0]);
const TWIST_LEFT: Torso = torso(0.0, [0.0, 5.0, 0.0], [0.0; 2]);
const TWIST_RIGHT: Torso = torso(-8.0, [0.0, -8.0, 0.0], [0.0; 2]);

/// The try-on routine of the demo.
const TRY_ON: [Key; 22] = [
    key(0.0, FRONT, [A; 2]),
    key(1.6, FRONT, [A; 2]),
    key(2.6, FRONT, [DOWN; 2]),
    key(3.6, LEFT, [DOWN; 2]),
    key(4.1, LEFT, [DOWN; 2]),
    key(5.9, RIGHT, [DOWN; 2]),
    key(6.9, FRONT, [DOWN; 2]),
    key(7.9, FRONT, [SIDE; 2]),
    key(8.8, BACK_BENT, [UP; 2]),
    key(10.2, FRONT, [DOWN; 2]),
    key(11.2, HIP_RIGHT, [DOWN, HIP]),
    key(12.4, HIP_LEFT, [DOWN, HIP]),
    key(13.4, FRONT, [DOWN; 2]),
    key_at(14.8, [0.35, 0.05], FRONT, [DOWN; 2]),
    key_at(16.4, [-0.25, 0.0], turned(-6.0), [DOWN; 2]),
    key(17.4, FRONT, [DOWN; 2]),
    key(18.2, HEAD_DOWN, [HEM; 2]),
    key(19.2, HEAD_DOWN_LEFT, [HEM; 2]),
    key(20.2, TWIST_LEFT, [ACROSS, DOWN]),
    key(21.2, TWIST_RIGHT, [ACROSS, DOWN]),
    key(22.4, FRONT, [DOWN; 2]),
    key(24.0, FRONT, [A; 2]),
];

/// To the left, to the right and back.
const TURN: [Key; 8] = [
    key(0.0, FRONT, [A; 2]),
    key(1.0, FRONT, [A; 2]),
    key(2.0, FRONT, [DOWN; 2]),
    key(3.0, turned(40.0), [DOWN; 2]),
    key(3.6, turned(40.0), [DOWN; 2]),
    key(5.2, turned(-40.0), [DOWN; 2]),
    key(5.8, turned(-40.0), [DOWN; 2]),
    key(7.2, FRONT, [A; 2]),
];

/// Out to the side and back.
const LEAVE: [Key; 8] = [
    key(0.0, FRONT, [A; 2]),
    key(2.0, FRONT, [A; 2]),
    key(2.6, turned(80.0), [DOWN; 2]),
    key_at(5.0, [3.6, 0.2], turned(80.0), [DOWN; 2]),
    key_at(7.0, [3.6, 0.2], turned(-80.0), [DOWN; 2]),
    key(9.4, turned(-80.0), [DOWN; 2]),
    key(10.2, FRONT, [A; 2]),
    key(12.0, FRONT, [A; 2]),
];

/// A figure of eight through the start, facing ahead.
const WALK: [Key; 12] = [
    key(0.0, FRONT, [A; 2]),
    key(0.8, turned(55.0), [DOWN; 2]),
    key_at(2.6, [0.8, 0.55], turned(55.0), [DOWN; 2]),
    key_at(3.6, [0.85, 0.5], turned(180.0), [DOWN; 2]),
    key_at(5.4, [0.85, -0.7], turned(180.0), [DOWN; 2]),
    key_at(6.4, [0.8, -0.75], turned(307.0), [DOWN; 2]),
    key_at(9.4, [-0.8, 0.5], turned(307.0), [DOWN; 2]),
    key_at(10.4, [-0.85, 0.45], turned(180.0), [DOWN; 2]),
    key_at(12.2, [-0.85, -0.7], turned(180.0), [DOWN; 2]),
    key_at(13.2, [-0.8, -0.75], turned(50.0), [DOWN; 2]),
    key(15.0, turned(50.0), [DOWN; 2]),
    key(15.8, FRONT, [A; 2]),
];

/// Up to the camera.
const APPROACH: [Key; 4] = [
    key_at(0.0, [0.0, -2.0], FRONT, [DOWN; 2]),
    key_at(0.3, [0.0, -2.0], FRONT, [DOWN; 2]),
    key_at(3.1, [0.0, 0.6], FRONT, [DOWN; 2]),
    key_at(8.0, [0.0, 0.6], FRONT, [DOWN; 2]),
];

/// Rises from 0 to 1 with speed and acceleration zero at both ends.
pub(super) fn ease(x: f64) -> f64 {
    let t = x.clamp(0.0, 1.0);
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

fn lerp<const N: usize>(a: [f64; N], b: [f64; N], s: f64) -> [f64; N] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * s)
}

/// Along the great circle; half a turn has none and does not occur between keys.
fn toward(a: &V3d, b: &V3d, s: f64) -> V3d {
    let (a, b) = (a.normalize(), b.normalize());
    UnitQuaternion::rotation_between(&a, &b).map_or(a, |q| q.powf(s) * a)
}

impl Routine {
    /// Length of one round, seconds.
    pub fn period(self) -> f64 {
        self.keys().last().map_or(1.0, |k| k.t.max(1.0))
    }
    /// An actor is present at some time.
    pub fn has_person(self) -> bool {
        self != Self::Empty
    }
    fn keys(self) -> &'static [Key] {
        match self {
            Self::TryOn => &TRY_ON,
            Self::LeaveAndReturn => &LEAVE,
            Self::Turn => &TURN,
            Self::Walk => &WALK,
            Self::Approach => &APPROACH,
            Self::Still | Self::Hold(_) | Self::Empty => &TRY_ON[..1],
        }
    }
    fn key(self, t: f64) -> Key {
        let keys = self.keys();
        let t = t.rem_euclid(self.period());
        let next = keys.partition_point(|k| k.t <= t).min(keys.len() - 1);
        let (a, b) = (&keys[next.saturating_sub(1)], &keys[next]);
        let s = if b.t > a.t {
            ease((t - a.t) / (b.t - a.t))
        } else {
            0.0
        };
        Key {
            t,
            place: lerp(a.place, b.place, s),
            yaw: a.yaw + (b.yaw - a.yaw) * s,
            chest: lerp(a.chest, b.chest, s),
            head: lerp(a.head, b.head, s),
            arms: std::array::from_fn(|side| {
                std::array::from_fn(|i| toward(&a.arms[side][i], &b.arms[side][i], s))
            }),
        }
    }

    /// Point under the ankle and yaw of a foot at `t`: planted under the pelvis of mid-stance, swinging between.
    fn sole(self, settings: &StanceSettings, side: usize, t: f64) -> (P3d, f64) {
        let StanceSettings {
            cycle,
            swing,
            lift: [share, most],
            half_stance,
            ..
        } = *settings;
        let phase = t / cycle - 0.5 * side as f64;
        let (round, part) = (phase.floor(), phase.rem_euclid(1.0));
        let planted = |round: f64| {
            // Middle of the stance that ends the cycle.
            let k = self.key(((round + 0.5 * (1.0 + swing) + 0.5 * side as f64) * cycle).max(0.0));
            let yaw = k.yaw.to_radians();
            let out = if side == 0 { half_stance } else { -half_stance };
            (
                P3d::new(
                    k.place[0] + out * yaw.cos(),
                    0.0,
                    k.place[1] - out * yaw.sin(),
                ),
                yaw,
            )
        };
        let (from, to) = (planted(round - 1.0), planted(round));
        let s = ease(part / swing);
        let step = (to.0 - from.0).norm() + 0.1 * (to.1 - from.1).abs();
        let lift = (share * step).min(most) * 4.0 * s * (1.0 - s);
        (
            from.0 + (to.0 - from.0) * s + V3d::y() * lift,
            from.1 + (to.1 - from.1) * s,
        )
    }

    /// The stance at `t` seconds; `home` is where the routine starts, on the floor.
    pub(super) fn stance(self, rig: &Rig, home: P3d, t: f64) -> Stance {
        if let Self::Hold(posture) = self {
            return posture.stance(rig, home);
        }
        let k = self.key(t);
        // Breath and sway: a few millimetres and tenths of a degree.
        let sway = [(0.9 * t).sin(), (1.3 * t + 1.0).sin(), (1.57 * t).sin()];
        let heading =
            UnitQuaternion::from_axis_angle(&V3d::y_axis(), (k.yaw + 0.6 * sway[0]).to_radians());
        let side = |s: usize| {
            let mirror = if s == 0 { 1.0 } else { -1.0 };
            k.arms[s].map(|d| v(mirror * d.x, d.y, d.z).normalize())
        };
        let chest = v(
            k.chest[0] + 0.5 * sway[2],
            k.chest[1] + 0.5 * sway[1],
            -k.chest[2],
        )
        .map(f64::to_radians);
        let head =
            v(k.head[0] + 0.7 * sway[1], k.head[1] + 0.8 * sway[0], 0.0).map(f64::to_radians);
        let pelvis = P3d::new(
            home.x + k.place[0] + 0.004 * sway[0],
            0.9,
            home.z + k.place[1] + 0.003 * sway[1],
        );
        let down = [-V3d::y(), -V3d::y(), V3d::z()];
        let mut stance = Stance {
            pelvis,
            heading,
            chest,
            head,
            arms: [side(0), side(1)].map(|limb| {
                let breath = exp_so3(&v(0.004 * sway[2], 0.0, 0.004 * sway[0]));
                limb.map(|d| breath * d)
            }),
            legs: [down, down],
            feet: [UnitQuaternion::identity(); 2],
        };
        let soles = [0, 1].map(|s| {
            let (p, yaw) = self.sole(&rig.settings, s, t.rem_euclid(self.period()));
            (home + p.coords, yaw)
        });
        rig.stand(&mut stance, soles);
        stance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_in_order_and_the_round_closes() {
        for r in [
            Routine::TryOn,
            Routine::LeaveAndReturn,
            Routine::Turn,
            Routine::Walk,
        ] {
            assert!(r.keys().windows(2).all(|w| w[0].t < w[1].t));
            let (a, b) = (r.key(0.0), r.key(r.period() - 1e-9));
            assert!((a.yaw - b.yaw).abs() < 1e-6 && (a.place[0] - b.place[0]).abs() < 1e-6);
            assert!((a.arms[0][0].normalize() - b.arms[0][0]).norm() < 1e-6);
        }
    }

    #[test]
    fn standing_feet_stay_where_they_are() {
        for i in 0..45 {
            let settings = StanceSettings::default();
            let (p, _) = Routine::TryOn.sole(&settings, 1, f64::from(i) / 30.0);
            assert!(
                (p - P3d::new(-settings.half_stance, 0.0, 0.0)).norm() < 1e-9,
                "frame {i}: {p}"
            );
        }
    }
}
