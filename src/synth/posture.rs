//! Postures that people take without being asked: held still, in directions of bones.

use super::stance::{Limb, Rig, Stance, limb};
use nalgebra::UnitQuaternion;
use tryon_geometry::math::{P3d, V3d};

/// A posture that is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Posture {
    /// Upright, arms hanging.
    Standing,
    /// Both hands joined before the chest.
    HandsJoined,
    /// Arms crossed before the chest.
    ArmsCrossed,
    /// Both hands on the hips, elbows out.
    HandsOnHips,
    /// Both arms straight up.
    Overhead,
    /// Squatting on both feet, forearms on the knees.
    Crouching,
    /// Kneeling on the right knee.
    OneKnee,
    /// Seated on a chair, hands on the thighs.
    Sitting,
}

const fn v(x: f64, y: f64, z: f64) -> V3d {
    V3d::new(x, y, z)
}

/// Directions of upper arm, forearm and hand as if both arms were left: x outward, y up, z forward.
type ArmDirections = [Limb; 2];

const HANGING: Limb = limb([0.2, -0.97, -0.05], [0.14, -0.97, 0.2], [0.08, -0.96, 0.24]);
const JOINED: Limb = limb([0.36, -0.86, 0.36], [-0.7, 0.28, 0.66], [-0.52, 0.66, 0.54]);
/// Forearm across the chest, in front of the other.
const CROSSED_OUTER: Limb = limb(
    [0.02, -0.84, 0.54],
    [-0.93, 0.22, 0.28],
    [-0.96, 0.16, -0.22],
);
/// Forearm across the chest, behind the other and lower.
const CROSSED_INNER: Limb = limb([0.04, -0.92, 0.38], [-0.95, 0.1, 0.28], [-0.98, 0.06, -0.1]);
const ON_HIP: Limb = limb(
    [0.66, -0.72, -0.22],
    [-0.52, -0.64, 0.56],
    [-0.25, -0.55, 0.79],
);
const STRAIGHT_UP: Limb = limb([0.26, 0.96, 0.06], [0.06, 0.99, 0.12], [0.04, 0.99, 0.08]);
const FOREARM_ON_KNEE: Limb = limb([0.2, -0.62, 0.76], [-0.1, -0.4, 0.91], [-0.1, -0.62, 0.78]);

const ON_THIGH: Limb = limb(
    [0.14, -0.95, 0.28],
    [-0.05, -0.42, 0.9],
    [-0.05, -0.3, 0.95],
);

impl Posture {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Standing,
        Self::HandsJoined,
        Self::ArmsCrossed,
        Self::HandsOnHips,
        Self::Overhead,
        Self::Crouching,
        Self::OneKnee,
        Self::Sitting,
    ];

    fn arms(self) -> ArmDirections {
        match self {
            Self::Standing => [HANGING; 2],
            Self::HandsJoined => [JOINED; 2],
            Self::ArmsCrossed => [CROSSED_OUTER, CROSSED_INNER],
            Self::HandsOnHips => [ON_HIP; 2],
            Self::Overhead => [STRAIGHT_UP; 2],
            Self::Crouching => [FOREARM_ON_KNEE; 2],
            Self::OneKnee => [FOREARM_ON_KNEE, HANGING],
            Self::Sitting => [ON_THIGH; 2],
        }
    }

    fn lean(self, rig: &Rig) -> f64 {
        let [squat, kneel] = rig.settings.leans;
        match self {
            Self::Crouching => squat,
            Self::OneKnee => kneel,
            _ => 0.0,
        }
        .to_radians()
    }

    /// The stance with feet around `home` on the floor, facing +z.
    pub(super) fn stance(self, rig: &Rig, home: P3d) -> Stance {
        let down = [-V3d::y(), -V3d::y(), V3d::z()];
        let side = |s: usize| {
            let mirror = if s == 0 { 1.0 } else { -1.0 };
            self.arms()[s].map(|d| v(mirror * d.x, d.y, d.z).normalize())
        };
        let (settings, lean) = (&rig.settings, self.lean(rig));
        let (half, squat) = (settings.half_stance, settings.half_squat);
        let mut stance = Stance {
            pelvis: P3d::new(home.x, 0.0, home.z),
            heading: UnitQuaternion::identity(),
            chest: v(lean, 0.0, 0.0),
            head: v(-0.7 * lean, 0.0, 0.0),
            arms: [side(0), side(1)],
            legs: [down, down],
            feet: [UnitQuaternion::identity(); 2],
        };
        let sole = |x: f64, z: f64| (home + v(x, 0.0, z), 0.0);
        match self {
            Self::Crouching => {
                let soles = [sole(squat, 0.06), sole(-squat, 0.06)];
                stance.pelvis.y = rig.ankle_height() + settings.squat * rig.leg_length();
                stance.pelvis.z -= 0.12;
                rig.plant(&mut stance, soles);
            }
            Self::OneKnee => kneel(rig, home, &mut stance),
            Self::Sitting => {
                let ahead = rig.thigh_length();
                stance.pelvis.y = settings.seated;
                rig.plant(&mut stance, [sole(half, ahead), sole(-half, ahead)]);
            }
            _ => rig.stand(&mut stance, [sole(half, 0.0), sole(-half, 0.0)]),
        }
        stance
    }
}

/// Right knee and toes on the floor, left sole in front.
fn kneel(rig: &Rig, home: P3d, stance: &mut Stance) {
    let settings = &rig.settings;
    let thigh = rig.thigh_length();
    let hip = rig.hip_center(&stance.heading);
    stance.pelvis.y = settings.knee_radius + thigh - hip.y;
    let front = (home + v(settings.half_stance, 0.0, 0.9 * thigh), 0.0);
    rig.plant(stance, [front, (home, 0.0)]);
    let toes_back = UnitQuaternion::from_axis_angle(&V3d::x_axis(), settings.toes_back);
    stance.feet[1] = toes_back;
    stance.legs[1] = [
        v(0.0, -1.0, 0.02).normalize(),
        v(0.0, 0.10, -1.0).normalize(),
        toes_back * V3d::z(),
    ];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Actor, Routine, Sequence, Setting, Truth};
    use tryon_geometry::camera::NoiseModel;

    fn held(posture: Posture) -> (Sequence, Truth) {
        let setting = Setting {
            routine: Routine::Hold(posture),
            noise: NoiseModel::None,
            color: false,
            ..Setting::default()
        };
        let sequence = Sequence::new(Actor::default(), setting);
        let truth = sequence.truth(0);
        (sequence, truth)
    }

    /// Height of a joint above the floor and its distance before the pelvis, metres.
    fn at(sequence: &Sequence, truth: &Truth, joint: &str) -> V3d {
        let skeleton = sequence.actor().template.skeleton();
        let k = skeleton.index(joint).expect(joint);
        let world = sequence.setting().world_from_camera;
        world.point(&truth.joints[k]).coords
    }

    #[test]
    fn every_posture_rests_on_the_floor() {
        for posture in Posture::ALL {
            let (sequence, truth) = held(posture);
            let world = sequence.setting().world_from_camera;
            let low = truth
                .vertices
                .iter()
                .map(|p| world.point(&p.cast()).y)
                .fold(f64::INFINITY, f64::min);
            assert!(low.abs() < 0.06, "{posture:?}: lowest point at {low} m");
        }
    }

    #[test]
    fn hands_are_where_the_posture_says() {
        let wrists = |p| {
            let (s, t) = held(p);
            [
                at(&s, &t, "left_wrist"),
                at(&s, &t, "right_wrist"),
                at(&s, &t, "spine3"),
                at(&s, &t, "head"),
                at(&s, &t, "pelvis"),
            ]
        };
        let [l, r, chest, ..] = wrists(Posture::HandsJoined);
        assert!((l - r).norm() < 0.25 && l.z > chest.z + 0.15, "{l} {r}");
        let [l, r, ..] = wrists(Posture::ArmsCrossed);
        assert!(l.x < r.x, "the left hand is on the right: {l} {r}");
        let [l, r, _, head, _] = wrists(Posture::Overhead);
        assert!(l.y > head.y + 0.1 && r.y > head.y + 0.1, "{l} {r}");
        let [l, _, _, _, pelvis] = wrists(Posture::HandsOnHips);
        assert!((l.y - pelvis.y).abs() < 0.2, "{l} {pelvis}");
    }

    #[test]
    fn knees_bend_in_squat_and_kneel() {
        let (s, t) = held(Posture::Crouching);
        assert!(at(&s, &t, "pelvis").y < 0.65 && at(&s, &t, "left_knee").y > 0.35);
        let (s, t) = held(Posture::Sitting);
        let (knee, pelvis) = (at(&s, &t, "left_knee"), at(&s, &t, "pelvis"));
        assert!(
            (knee.y - pelvis.y).abs() < 0.15 && knee.z > pelvis.z + 0.3,
            "{knee} {pelvis}"
        );
        let (s, t) = held(Posture::OneKnee);
        let (left, right) = (at(&s, &t, "left_knee"), at(&s, &t, "right_knee"));
        assert!(right.y < 0.12 && left.y > 0.35, "{left} {right}");
        assert!(left.z > right.z + 0.25, "{left} {right}");
    }
}
