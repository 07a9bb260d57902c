//! Random stances: key poses of arms, legs and torso, and the try-on routine; mixed, with noise.

use super::settings::LabelledSettings;
use crate::routine::Routine;
use crate::stance::{Limb, Rig, Stance, limb};
use nalgebra::UnitQuaternion;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use tryon_body::Skeleton;
use tryon_geometry::math::{P3d, V3d, exp_so3};

const fn v(x: f64, y: f64, z: f64) -> V3d {
    V3d::new(x, y, z)
}

/// Upper arm, forearm and hand as if left: x outward, y up, z forward, chest axes.
const ARMS: [Limb; 24] = [
    // Hanging, a little out, calibration pose, to the side, up and out.
    limb([0.15, -0.98, 0.02], [0.1, -0.97, 0.2], [0.05, -0.98, 0.2]),
    limb(
        [0.34, -0.93, -0.06],
        [0.24, -0.93, 0.24],
        [0.12, -0.95, 0.26],
    ),
    limb([0.72, -0.69, 0.0], [0.68, -0.7, 0.18], [0.66, -0.7, 0.18]),
    limb([0.99, -0.02, 0.04], [0.97, 0.02, 0.22], [0.98, 0.0, 0.18]),
    limb([0.62, 0.76, 0.12], [0.4, 0.88, 0.22], [0.36, 0.92, 0.14]),
    // Hands joined over the head, and before the chest; arms crossed; hand on the hip; in the pocket.
    limb([0.35, 0.9, 0.2], [-0.45, 0.88, 0.1], [-0.4, 0.9, 0.1]),
    limb([0.35, -0.8, 0.35], [-0.75, 0.3, 0.6], [-0.75, 0.5, 0.4]),
    limb([0.25, -0.85, 0.45], [-0.93, 0.12, 0.33], [-0.95, 0.2, 0.05]),
    limb(
        [0.66, -0.72, -0.22],
        [-0.52, -0.64, 0.56],
        [-0.25, -0.55, 0.79],
    ),
    limb([0.32, -0.93, -0.12], [0.0, -0.92, 0.38], [-0.1, -0.95, 0.3]),
    // Forward, forward and down, forearm forward, guard of a boxer, punch.
    limb([0.1, -0.08, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]),
    limb([0.2, -0.65, 0.72], [0.0, -0.35, 0.93], [0.0, -0.4, 0.9]),
    limb([0.2, -0.95, 0.15], [0.0, -0.1, 1.0], [0.0, 0.0, 1.0]),
    limb([0.25, -0.85, 0.45], [-0.25, 0.75, 0.6], [-0.25, 0.75, 0.6]),
    limb([-0.05, -0.1, 1.0], [-0.15, 0.02, 1.0], [-0.15, 0.0, 1.0]),
    // Waving, hand to the head, to the mouth, behind the back, backward.
    limb([0.85, -0.3, 0.2], [0.3, 0.92, 0.2], [0.2, 0.96, 0.1]),
    limb([0.75, 0.4, 0.3], [-0.75, 0.62, 0.1], [-0.9, 0.2, 0.0]),
    limb([0.3, -0.7, 0.6], [-0.4, 0.88, 0.15], [-0.4, 0.9, 0.0]),
    limb([0.35, -0.88, -0.35], [-0.7, -0.5, -0.5], [-0.9, -0.2, -0.3]),
    limb([0.25, -0.8, -0.55], [0.2, -0.85, -0.4], [0.2, -0.85, -0.4]),
    // Down to a club, swing of a club, hand on the other shoulder; elbows at shoulder height, forearms up, down.
    limb(
        [0.05, -0.82, 0.57],
        [-0.35, -0.75, 0.55],
        [-0.35, -0.75, 0.55],
    ),
    limb([-0.5, 0.1, 0.86], [-0.7, 0.5, 0.5], [-0.6, 0.7, 0.3]),
    limb([0.98, 0.0, 0.15], [0.05, 0.98, 0.15], [0.0, 0.98, 0.1]),
    limb([0.95, -0.05, 0.25], [0.05, -0.95, 0.3], [0.0, -0.95, 0.3]),
];

/// Thigh and shank of one leg as if left.
type LegKey = [V3d; 2];
const STAND: LegKey = [v(0.06, -1.0, 0.02), v(0.03, -1.0, -0.03)];
const WIDE: LegKey = [v(0.35, -0.94, 0.06), v(0.3, -0.95, -0.05)];
const AHEAD: LegKey = [v(0.05, -0.9, 0.42), v(0.03, -0.98, -0.1)];
const BEHIND: LegKey = [v(0.05, -0.94, -0.3), v(0.02, -0.75, -0.65)];
const SEATED: LegKey = [v(0.18, -0.12, 0.98), v(0.08, -1.0, 0.0)];
const CROUCHED: LegKey = [v(0.3, 0.2, 0.92), v(0.1, -0.72, -0.65)];
const SQUAT: LegKey = [v(0.25, -0.6, 0.75), v(0.1, -0.85, -0.4)];
const KNEELING: LegKey = [v(0.06, -1.0, 0.05), v(0.03, -0.15, -1.0)];
const KNEE_UP: LegKey = [v(0.1, -0.2, 0.95), v(0.05, -0.97, -0.2)];
const KICK: LegKey = [v(0.1, -0.45, 0.88), v(0.1, -0.35, 0.93)];
const LUNGE: LegKey = [v(0.1, -0.35, 0.92), v(0.05, -1.0, -0.05)];
const SIDE_LUNGE: LegKey = [v(0.55, -0.75, 0.3), v(0.1, -0.98, -0.1)];

/// Pairs of legs with their weights.
const LEGS: [(LegKey, LegKey, f64); 13] = [
    (STAND, STAND, 0.42),
    (WIDE, WIDE, 0.1),
    (AHEAD, BEHIND, 0.12),
    (STAND, BEHIND, 0.05),
    (SEATED, SEATED, 0.06),
    (CROUCHED, CROUCHED, 0.03),
    (SQUAT, SQUAT, 0.04),
    (LUNGE, KNEELING, 0.04),
    (KNEELING, KNEELING, 0.02),
    (STAND, KNEE_UP, 0.03),
    (STAND, KICK, 0.03),
    (LUNGE, BEHIND, 0.03),
    (SIDE_LUNGE, WIDE, 0.03),
];

/// Torsos: pelvis bent forward, chest bent forward, twisted to the left, leaning to the left, degrees; weight.
const TORSOS: [([f64; 4], f64); 8] = [
    ([0.0, 0.0, 0.0, 0.0], 0.55),
    ([0.0, 0.0, 40.0, 0.0], 0.12),
    ([20.0, 20.0, 20.0, 0.0], 0.06),
    ([10.0, 30.0, 0.0, 0.0], 0.07),
    ([40.0, 40.0, 0.0, 0.0], 0.06),
    ([65.0, 60.0, 0.0, 0.0], 0.04),
    ([0.0, -15.0, 0.0, 0.0], 0.04),
    ([0.0, 0.0, 0.0, 22.0], 0.06),
];

fn normal(rng: &mut Pcg64Mcg) -> f64 {
    StandardNormal.sample(rng)
}

/// Index by weight.
fn pick<T>(items: &[T], weight: impl Fn(&T) -> f64, rng: &mut Pcg64Mcg) -> usize {
    let total: f64 = items.iter().map(&weight).sum();
    let mut left = rng.random::<f64>() * total;
    items
        .iter()
        .position(|i| {
            left -= weight(i);
            left < 0.0
        })
        .unwrap_or(0)
}

/// A direction turned by a random small angle.
fn shaken(d: &V3d, degrees: f64, rng: &mut Pcg64Mcg) -> V3d {
    let turn = v(normal(rng), normal(rng), normal(rng)) * degrees.to_radians();
    exp_so3(&turn) * d.normalize()
}

/// Mirror image.
fn outward(side: usize, d: &V3d) -> V3d {
    if side == 0 { *d } else { v(-d.x, d.y, d.z) }
}

/// A key pose with noise, facing +z.
fn key_pose(settings: &LabelledSettings, rng: &mut Pcg64Mcg) -> Stance {
    let noise = settings.noise;
    let first = rng.random_range(0..ARMS.len());
    let second = if rng.random_bool(settings.alike) {
        first
    } else {
        rng.random_range(0..ARMS.len())
    };
    let arms = [first, second];
    let parallel = rng.random_bool(settings.parallel);
    let lead = usize::from(rng.random_bool(0.5));
    let arms = [0, 1].map(|s| {
        let (key, side) = if parallel {
            (arms[0], lead)
        } else {
            (arms[s], s)
        };
        ARMS[key].map(|d| shaken(&outward(side, &d), noise[0], rng))
    });
    let (left, right, _) = LEGS[pick(&LEGS, |l| l.2, rng)];
    let legs = if rng.random_bool(0.5) {
        [left, right]
    } else {
        [right, left]
    };
    let ([pelvis, chest, twist, lean], _) = TORSOS[pick(&TORSOS, |t| t.1, rng)];
    let mirror = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let heading = exp_so3(&v((pelvis + 3.0 * normal(rng)).to_radians(), 0.0, 0.0));
    let level = heading.inverse();
    let legs = [0, 1].map(|s| {
        let [thigh, shank] = legs[s].map(|d| level * shaken(&outward(s, &d), noise[1], rng));
        [thigh, shank, level * V3d::z()]
    });
    let yaw = |rng: &mut Pcg64Mcg| exp_so3(&v(0.0, 0.2 * normal(rng), 0.0));
    let mut angle = |mean: f64, spread: f64| (mean + spread * normal(rng)).to_radians();
    let chest = v(
        angle(chest, noise[2]),
        angle(mirror * twist, noise[2]),
        angle(-mirror * lean, noise[2]),
    );
    let head = v(
        angle(5.0, noise[3]),
        angle(0.0, 1.5 * noise[3]),
        angle(0.0, 0.5 * noise[3]),
    );
    Stance {
        pelvis: P3d::origin(),
        heading,
        chest,
        head,
        arms,
        legs,
        feet: [yaw(rng), yaw(rng)],
    }
}

/// A random stance over the origin, turned anywhere.
pub(super) fn draw(settings: &LabelledSettings, rig: &Rig, rng: &mut Pcg64Mcg) -> Stance {
    let mut stance = if rng.random::<f64>() < settings.routine {
        let t = rng.random::<f64>() * Routine::TryOn.period();
        Routine::TryOn.stance(rig, P3d::origin(), t)
    } else {
        let key = key_pose(settings, rng);
        if rng.random_bool(settings.between) {
            key.blend(&key_pose(settings, rng), rng.random())
        } else {
            key
        }
    };
    let yaw = rng.random_range(-std::f64::consts::PI..std::f64::consts::PI);
    let turn = UnitQuaternion::from_axis_angle(&V3d::y_axis(), yaw);
    stance.pelvis = P3d::origin();
    stance.heading = turn * stance.heading;
    stance.feet = stance.feet.map(|f| turn * f);
    stance
}

/// True if an elbow or a wrist is within `radius` (m) of the axis of the trunk.
pub(super) fn penetrates(skeleton: &Skeleton, joints: &[P3d], radius: f64) -> bool {
    let at = |name: &str| skeleton.index(name).map(|j| joints[j]);
    let (Some(pelvis), Some(neck)) = (at("pelvis"), at("neck")) else {
        return false;
    };
    let axis = neck - pelvis;
    let inside = |p: P3d| {
        let t = (p - pelvis).dot(&axis) / axis.norm_squared().max(f64::MIN_POSITIVE);
        (-0.1..1.0).contains(&t) && (p - (pelvis + axis * t)).norm() < radius
    };
    [
        "left_elbow",
        "right_elbow",
        "left_wrist",
        "right_wrist",
        "left_hand_end",
        "right_hand_end",
    ]
    .iter()
    .filter_map(|n| at(n))
    .any(inside)
}
