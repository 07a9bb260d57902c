//! The skeleton of the figure and its skinning weights.

use super::BodySettings;
use super::figure::Joints;
use tryon_body::{BodyError, Joint, JointMotion, Skeleton, SkinWeights};
use tryon_geometry::math::{P3d, V3d};
use tryon_geometry::mesh::Topology;
use tryon_geometry::mesh::smoothing::smoothed;
use tryon_geometry::par::{self, Par};

/// Mirror image at x = 0.
fn mirrored(p: P3d) -> P3d {
    P3d::new(-p.x, p.y, p.z)
}

const fn deg(d: f64) -> f64 {
    d * std::f64::consts::PI / 180.0
}

fn ball(x: [f64; 2], y: [f64; 2], z: [f64; 2]) -> JointMotion {
    JointMotion::Ball {
        limits: [x, y, z].map(|l| l.map(deg)),
    }
}

/// Limits of a right joint: mirrored at x = 0, rotations about y and z change sign.
fn mirror_motion(m: &JointMotion) -> JointMotion {
    match m {
        JointMotion::Fixed => JointMotion::Fixed,
        JointMotion::Hinge { axis, limits } => JointMotion::Hinge {
            axis: [axis[0], -axis[1], -axis[2]],
            limits: *limits,
        },
        JointMotion::Ball { limits: [x, y, z] } => JointMotion::Ball {
            limits: [*x, [-y[1], -y[0]], [-z[1], -z[0]]],
        },
    }
}

/// Joints in the order in which they are added.
#[derive(Default)]
struct JointList(Vec<Joint>);

impl JointList {
    fn add(&mut self, name: &str, parent: &str, rest: P3d, motion: JointMotion) {
        let parent = self.0.iter().position(|o| o.name == parent);
        self.0.push(Joint {
            name: name.into(),
            parent,
            rest,
            motion,
        });
    }
    /// Adds a left joint and its mirror image.
    fn add_pair(&mut self, name: &str, parent: &str, rest: P3d, motion: JointMotion) {
        let of = |side: &str| match parent {
            "pelvis" | "spine3" => parent.to_owned(),
            _ => format!("{side}_{parent}"),
        };
        let right = mirror_motion(&motion);
        self.add(&format!("left_{name}"), &of("left"), rest, motion);
        self.add(
            &format!("right_{name}"),
            &of("right"),
            mirrored(rest),
            right,
        );
    }
}

/// The kinematic tree with SMPL's names.
///
/// Limits: mean ranges of motion of healthy adults, Kapandji (The Physiology of the Joints) and AAOS (1965), rounded up
/// to the next 5° and shifted by the rest pose (arms 45° down, elbows bent 10°).
pub(super) fn joints(j: &Joints) -> Vec<Joint> {
    // Flexion of the left elbow brings the forearm forward; of the knee, the shank backward.
    let elbow_axis: V3d = (j.elbow - j.shoulder).cross(&V3d::z()).normalize();
    let thigh = j.knee - j.hip;
    let knee_axis: V3d = V3d::z().cross(&thigh).normalize();
    let hinge = |a: V3d, l: [f64; 2]| JointMotion::Hinge {
        axis: [a.x, a.y, a.z],
        limits: l.map(deg),
    };
    let fixed = JointMotion::Fixed;
    let spine = || ball([-15.0, 30.0], [-20.0, 20.0], [-15.0, 15.0]);
    let mut out = JointList::default();
    out.add("pelvis", "", j.pelvis, fixed.clone());
    // Hip: flexion 120 (−x), extension 20; rotation 45; abduction 45 (+z), adduction 30.
    let hip = ball([-125.0, 25.0], [-45.0, 45.0], [-30.0, 50.0]);
    out.add_pair("hip", "pelvis", j.hip, hip);
    out.add("spine1", "pelvis", j.spine[0], spine());
    out.add_pair("knee", "hip", j.knee, hinge(knee_axis, [-5.0, 145.0]));
    out.add("spine2", "spine1", j.spine[1], spine());
    // Ankle: dorsiflexion 20 (−x), plantar flexion 50; inversion and eversion.
    let ankle = ball([-25.0, 50.0], [-20.0, 20.0], [-25.0, 35.0]);
    out.add_pair("ankle", "knee", j.ankle, ankle);
    out.add("spine3", "spine2", j.spine[2], spine());
    out.add_pair("foot", "ankle", j.foot, fixed.clone());
    out.add_pair("foot_end", "foot", j.foot_end, fixed.clone());
    let neck = ball([-35.0, 35.0], [-45.0, 45.0], [-25.0, 25.0]);
    out.add("neck", "spine3", j.neck, neck);
    // Shoulder girdle: elevation 40, protraction 20.
    let collar = ball([-15.0, 15.0], [-25.0, 20.0], [-15.0, 40.0]);
    out.add_pair("collar", "spine3", j.collar, collar);
    let head = ball([-30.0, 30.0], [-45.0, 45.0], [-20.0, 20.0]);
    out.add("head", "neck", j.head, head);
    out.add("head_end", "head", j.head_end, fixed.clone());
    // Shoulder from 45° abduction: up to overhead (+135) and across the body; flexion 170.
    let shoulder = ball([-110.0, 110.0], [-140.0, 60.0], [-80.0, 135.0]);
    out.add_pair("shoulder", "collar", j.shoulder, shoulder);
    out.add_pair(
        "elbow",
        "shoulder",
        j.elbow,
        hinge(elbow_axis, [-15.0, 140.0]),
    );
    let wrist = ball([-90.0, 90.0], [-80.0, 80.0], [-80.0, 80.0]);
    out.add_pair("wrist", "elbow", j.wrist, wrist);
    out.add_pair("hand_end", "wrist", j.hand_end, fixed);
    out.0
}

/// 0 below −1, 1 above +1, smooth between (quintic).
fn smooth(x: f64) -> f64 {
    let t = (0.5 * (x + 1.0)).clamp(0.0, 1.0);
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

/// Share of a joint's subtree at a point: 0 on the parent's side of the plane through `at`, 1 beyond.
fn beyond(p: &P3d, at: &P3d, normal: V3d, width: f64) -> f64 {
    smooth((p - at).dot(&normal.normalize()) / width)
}

/// Distance to the bones of the arm, metres.
fn distance_to_arm(j: &Joints, p: &P3d) -> f64 {
    [
        (j.shoulder, j.elbow),
        (j.elbow, j.wrist),
        (j.wrist, j.hand_end),
    ]
    .iter()
    .map(|(a, b)| {
        let d = b - a;
        let t = ((p - a).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
        (p - (a + d * t)).norm()
    })
    .fold(f64::INFINITY, f64::min)
}

/// Share of the arm's subtree at a point.
fn arm_share(settings: &BodySettings, j: &Joints, p: &P3d) -> f64 {
    let [width, depth, middle] = settings.chest;
    // A plane through the shoulder joint, tilted so that the armpit belongs to both arm and trunk.
    let at = j.shoulder + V3d::new(-0.014, 0.0, 0.0);
    let cut = beyond(p, &at, V3d::new(0.98, -0.12, 0.0), 0.085);
    // A point nearer to the chest than to the arm stays with the chest; far from the arm there is no arm at all.
    let reach = distance_to_arm(j, p);
    let (ex, ez) = (p.x / width, (p.z - middle) / depth);
    let from_chest = ((ex * ex + ez * ez).sqrt() - 1.0) * 0.5 * (width + depth);
    let below = smooth((j.shoulder.y - 0.02 - p.y) / 0.03);
    let apart = 1.0 - below * (1.0 - smooth((from_chest - (reach - settings.arm)) / 0.035));
    cut * apart * smooth((0.115 - reach) / 0.025)
}

/// Share of the shoulder girdle between the neck and the shoulder, chest upwards, without the arm.
fn girdle_share(p: &P3d) -> f64 {
    let at = P3d::new(0.075, 1.36, 0.0);
    beyond(p, &at, V3d::new(0.75, 0.66, 0.0), 0.075)
        * smooth((p.x - 0.055) / 0.05)
        * smooth((1.43 - p.y) / 0.03)
}

/// Share of the leg's subtree at a point, without regard to the spine.
fn leg_share(j: &Joints, p: &P3d) -> f64 {
    // A plane that rises outward and forward (the groin).
    let at = j.hip + V3d::new(0.0, -0.010, 0.0);
    let hip = beyond(p, &at, V3d::new(0.30, -0.95, 0.05), 0.085) * smooth(p.x / 0.030 - 0.4);
    let low = 1.0 - smooth((p.y - 0.98) / 0.03);
    hip * low
}

/// Share beyond the hinge between two bones.
fn beyond_hinge(p: &P3d, [a, b, c]: [P3d; 3], width: f64) -> f64 {
    beyond(p, &b, (b - a).normalize() + (c - b).normalize(), width)
}

/// Weights of a point of the left half (x ≥ 0) by joint name; shares of subtrees are multiplied down the tree.
pub(super) fn weights(settings: &BodySettings, j: &Joints, p: &P3d) -> Vec<(&'static str, f64)> {
    let up = V3d::y();
    let arm = arm_share(settings, j, p);
    let elbow = beyond_hinge(p, [j.shoulder, j.elbow, j.wrist], 0.038);
    let wrist = beyond_hinge(p, [j.elbow, j.wrist, j.hand_end], 0.030);
    let collar = girdle_share(p).max(arm);
    let neck = j.neck + V3d::new(0.0, 0.01, 0.0);
    let neck = beyond(p, &neck, V3d::new(0.0, 0.95, 0.2), 0.040);
    let head = j.head + V3d::new(0.0, -0.01, 0.0);
    let head = beyond(p, &head, V3d::new(0.0, 0.94, 0.34), 0.034);
    let knee = beyond_hinge(p, [j.hip, j.knee, j.ankle], 0.050);
    let ankle = beyond(p, &j.ankle, V3d::new(0.0, -0.85, 0.5), 0.035);
    let s1 = beyond(p, &j.spine[0], up, 0.055);
    let s2 = beyond(p, &j.spine[1], up, 0.055);
    let s3 = beyond(p, &j.spine[2], up, 0.060);
    // Subtree shares, parents before children.
    let s1_or_arm = s1.max(arm);
    let trunk3 = (s1 * s2 * s3).max(arm);
    let collar_share = collar * trunk3;
    let shoulder_share = arm.min(collar_share);
    let neck_share = (neck * (1.0 - collar_share)).min(trunk3);
    let head_share = neck_share * head;
    let elbow_share = shoulder_share * elbow;
    let wrist_share = elbow_share * wrist;
    let s2_share = (s1 * s2).max(trunk3);
    let s1_share = s1_or_arm.max(s2_share);
    let hip_share = leg_share(j, p) * (1.0 - s1_share);
    let knee_share = hip_share * knee;
    let ankle_share = knee_share * ankle;
    vec![
        ("pelvis", 1.0 - s1_share - hip_share),
        ("left_hip", hip_share - knee_share),
        ("left_knee", knee_share - ankle_share),
        ("left_ankle", ankle_share),
        ("spine1", s1_share - s2_share),
        ("spine2", s2_share - trunk3),
        ("spine3", trunk3 - neck_share - collar_share),
        ("neck", neck_share - head_share),
        ("head", head_share),
        ("left_collar", collar_share - shoulder_share),
        ("left_shoulder", shoulder_share - elbow_share),
        ("left_elbow", elbow_share - wrist_share),
        ("left_wrist", wrist_share),
    ]
}

/// Weights of all vertices: evaluated on the left, mirrored, then smoothed along the surface.
///
/// # Errors
/// Names a vertex without weight; none in a correct build.
pub(super) fn skin_weights(
    settings: &BodySettings,
    j: &Joints,
    points: &[P3d],
    topology: &Topology,
    skeleton: &Skeleton,
) -> Result<SkinWeights, BodyError> {
    let names = weights(settings, j, &j.pelvis).into_iter().map(|(n, _)| n);
    let names: Vec<&str> = names.collect();
    let left: Vec<Option<usize>> = names.iter().map(|n| skeleton.index(n)).collect();
    let right: Vec<Option<usize>> = names
        .iter()
        .map(|n| skeleton.index(&n.replace("left_", "right_")))
        .collect();
    let joints = skeleton.len();
    let mut rows: Vec<Vec<f64>> = Vec::new();
    par::map_into(Par::Rayon, points.len(), 256, &mut rows, |i| {
        let p = points[i];
        let mut row = vec![0.0; joints];
        for (k, (_, w)) in weights(settings, j, &P3d::new(p.x.abs(), p.y, p.z))
            .into_iter()
            .enumerate()
        {
            // A vertex in the middle belongs to both sides alike.
            let sides = if p.x == 0.0 {
                [left[k], right[k]]
            } else {
                [if p.x > 0.0 { left[k] } else { right[k] }; 2]
            };
            sides.into_iter().flatten().for_each(|s| row[s] += 0.5 * w);
        }
        row
    });
    for _ in 0..settings.weight_smoothing {
        rows = smoothed(Par::Rayon, topology.vertex_neighbours(), &rows);
    }
    let kept = rows.into_iter().map(|r| {
        r.into_iter()
            .enumerate()
            .filter(|(_, w)| *w > settings.least_weight)
            .collect()
    });
    SkinWeights::from_rows(kept)
}
