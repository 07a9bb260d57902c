//! The skeleton of the figure and its skinning weights.

use super::figure::Joints;
use crate::body::{BodyError, Joint, JointMotion, Skeleton, SkinWeights};
use crate::math::{P3d, V3d};
use crate::mesh::Topology;
use crate::par::{self, Par};

/// Joints without a side, then left; right is mirrored.
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

/// The kinematic tree with SMPL's names. Limits: mean ranges of motion of healthy adults, Kapandji (The Physiology of
/// the Joints) and AAOS (1965), rounded up to the next 5° and shifted by the rest pose (arms 45° down, elbows bent 10°).
pub(super) fn joints(j: &Joints) -> Vec<Joint> {
    // Flexion of the left elbow brings the forearm forward; of the knee, the shank backward.
    let elbow_axis: V3d = (j.elbow - j.shoulder).cross(&V3d::z()).normalize();
    let thigh = j.knee - j.hip;
    let knee_axis: V3d = V3d::z().cross(&thigh).normalize();
    let hinge = |a: V3d, l: [f64; 2]| JointMotion::Hinge {
        axis: [a.x, a.y, a.z],
        limits: l.map(deg),
    };
    let spine = || ball([-15.0, 30.0], [-20.0, 20.0], [-15.0, 15.0]);
    let mut out: Vec<Joint> = Vec::new();
    let mut add = |name: &str, parent: &str, rest: P3d, motion: JointMotion| {
        let parent = out.iter().position(|o| o.name == parent);
        out.push(Joint {
            name: name.into(),
            parent,
            rest,
            motion,
        });
    };
    let both = |add: &mut dyn FnMut(&str, &str, P3d, JointMotion),
                name: &str,
                parent: &str,
                rest: P3d,
                m: JointMotion| {
        let side = |s: &str, n: &str| {
            if matches!(n, "pelvis" | "spine3") {
                n.to_owned()
            } else {
                format!("{s}_{n}")
            }
        };
        add(
            &format!("left_{name}"),
            &side("left", parent),
            rest,
            m.clone(),
        );
        add(
            &format!("right_{name}"),
            &side("right", parent),
            mirrored(rest),
            mirror_motion(&m),
        );
    };
    add("pelvis", "", j.pelvis, JointMotion::Fixed);
    // Hip: flexion 120 (−x), extension 20; rotation 45; abduction 45 (+z), adduction 30.
    both(
        &mut add,
        "hip",
        "pelvis",
        j.hip,
        ball([-125.0, 25.0], [-45.0, 45.0], [-30.0, 50.0]),
    );
    add("spine1", "pelvis", j.spine[0], spine());
    both(
        &mut add,
        "knee",
        "hip",
        j.knee,
        hinge(knee_axis, [-5.0, 145.0]),
    );
    add("spine2", "spine1", j.spine[1], spine());
    // Ankle: dorsiflexion 20 (−x), plantar flexion 50; inversion and eversion.
    both(
        &mut add,
        "ankle",
        "knee",
        j.ankle,
        ball([-25.0, 50.0], [-20.0, 20.0], [-25.0, 35.0]),
    );
    add("spine3", "spine2", j.spine[2], spine());
    both(&mut add, "foot", "ankle", j.foot, JointMotion::Fixed);
    both(&mut add, "foot_end", "foot", j.foot_end, JointMotion::Fixed);
    add(
        "neck",
        "spine3",
        j.neck,
        ball([-35.0, 35.0], [-45.0, 45.0], [-25.0, 25.0]),
    );
    // Shoulder girdle: elevation 40, protraction 20.
    both(
        &mut add,
        "collar",
        "spine3",
        j.collar,
        ball([-15.0, 15.0], [-25.0, 20.0], [-15.0, 40.0]),
    );
    add(
        "head",
        "neck",
        j.head,
        ball([-30.0, 30.0], [-45.0, 45.0], [-20.0, 20.0]),
    );
    add("head_end", "head", j.head_end, JointMotion::Fixed);
    // Shoulder from 45° abduction: up to overhead (+135) and across the body; flexion 170.
    both(
        &mut add,
        "shoulder",
        "collar",
        j.shoulder,
        ball([-110.0, 110.0], [-140.0, 60.0], [-80.0, 135.0]),
    );
    both(
        &mut add,
        "elbow",
        "shoulder",
        j.elbow,
        hinge(elbow_axis, [-15.0, 140.0]),
    );
    both(
        &mut add,
        "wrist",
        "elbow",
        j.wrist,
        ball([-90.0, 90.0], [-80.0, 80.0], [-80.0, 80.0]),
    );
    both(
        &mut add,
        "hand_end",
        "wrist",
        j.hand_end,
        JointMotion::Fixed,
    );
    out
}

/// 0 below −1, 1 above +1, smooth between (quintic).
fn smooth(x: f64) -> f64 {
    let t = (0.5 * (x + 1.0)).clamp(0.0, 1.0);
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

/// Share of a point that a joint's subtree carries: 0 on the parent's side of the plane through `at`, 1 beyond.
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

/// The chest under the armpits as an elliptic cylinder: half width, half depth and middle in z, metres.
const CHEST: [f64; 3] = [0.165, 0.118, 0.0];
/// Radius of the upper arm near the armpit, metres.
const ARM: f64 = 0.050;

/// Weights of a point of the left half (x ≥ 0) by joint name; shares of subtrees are multiplied down the tree.
pub(super) fn weights(j: &Joints, p: &P3d) -> Vec<(&'static str, f64)> {
    let up = V3d::y();
    // Arm against trunk: a plane through the shoulder joint, tilted so that the armpit belongs to both.
    let arm_axis = (j.elbow - j.shoulder).normalize();
    let cut = beyond(
        p,
        &(j.shoulder + V3d::new(-0.014, 0.0, 0.0)),
        V3d::new(0.98, -0.12, 0.0),
        0.085,
    );
    let elbow = beyond(
        p,
        &j.elbow,
        arm_axis + (j.wrist - j.elbow).normalize(),
        0.038,
    );
    let wrist = beyond(
        p,
        &j.wrist,
        (j.hand_end - j.wrist).normalize() + (j.wrist - j.elbow).normalize(),
        0.030,
    );
    // What is nearer to the chest than to the arm stays with the chest; far from the arm there is no arm at all.
    let reach = distance_to_arm(j, p);
    let (ex, ez) = (p.x / CHEST[0], (p.z - CHEST[2]) / CHEST[1]);
    let from_chest = ((ex * ex + ez * ez).sqrt() - 1.0) * 0.5 * (CHEST[0] + CHEST[1]);
    let below = smooth((j.shoulder.y - 0.02 - p.y) / 0.03);
    let apart = 1.0 - below * (1.0 - smooth((from_chest - (reach - ARM)) / 0.035));
    let is_arm = cut * apart * smooth((0.115 - reach) / 0.025);
    // Girdle: between the neck and the shoulder, chest upwards.
    let collar = beyond(
        p,
        &P3d::new(0.075, 1.36, 0.0),
        V3d::new(0.75, 0.66, 0.0),
        0.075,
    ) * smooth((p.x - 0.055) / 0.05)
        * smooth((1.43 - p.y) / 0.03);
    let collar = collar.max(is_arm);
    let neck = beyond(
        p,
        &(j.neck + V3d::new(0.0, 0.01, 0.0)),
        V3d::new(0.0, 0.95, 0.2),
        0.040,
    );
    let head = beyond(
        p,
        &(j.head + V3d::new(0.0, -0.01, 0.0)),
        V3d::new(0.0, 0.94, 0.34),
        0.034,
    );
    // Leg against pelvis: a plane that rises outward and forward (the groin).
    let hip = beyond(
        p,
        &(j.hip + V3d::new(0.0, -0.010, 0.0)),
        V3d::new(0.30, -0.95, 0.05),
        0.085,
    ) * smooth(p.x / 0.030 - 0.4);
    let knee = beyond(
        p,
        &j.knee,
        (j.knee - j.hip).normalize() + (j.ankle - j.knee).normalize(),
        0.050,
    );
    let ankle = beyond(p, &j.ankle, V3d::new(0.0, -0.85, 0.5), 0.035);
    let low = 1.0 - smooth((p.y - 0.98) / 0.03);
    let hip = hip * low;
    let s1 = beyond(p, &j.spine[0], up, 0.055);
    let s2 = beyond(p, &j.spine[1], up, 0.055);
    let s3 = beyond(p, &j.spine[2], up, 0.060);
    // Subtree shares, parents before children.
    let spine3 = s1 * s2 * s3;
    let arm = s1.max(is_arm);
    let trunk3 = spine3.max(is_arm);
    let collar_share = collar * trunk3;
    let shoulder_share = is_arm.min(collar_share);
    let neck_share = (neck * (1.0 - collar_share)).min(trunk3);
    let head_share = neck_share * head;
    let elbow_share = shoulder_share * elbow;
    let wrist_share = elbow_share * wrist;
    let s2_share = (s1 * s2).max(trunk3);
    let s1_share = arm.max(s2_share);
    let hip_share = hip * (1.0 - s1_share);
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

/// Rounds of averaging over neighbours: they take the kinks out of the products above, over about 4 cm on the trunk.
const SMOOTHING: usize = 16;

/// Weights of all vertices: evaluated on the left, mirrored, then smoothed along the surface.
///
/// # Errors
/// Names a vertex without weight; none in a correct build.
pub(super) fn skin_weights(
    j: &Joints,
    points: &[P3d],
    topology: &Topology,
    skeleton: &Skeleton,
) -> Result<SkinWeights, BodyError> {
    let names: Vec<&str> = weights(j, &j.pelvis).into_iter().map(|(n, _)| n).collect();
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
        for (k, (_, w)) in weights(j, &P3d::new(p.x.abs(), p.y, p.z))
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
    for _ in 0..SMOOTHING {
        let mut next = Vec::new();
        par::map_into(Par::Rayon, rows.len(), 256, &mut next, |i| {
            let around = topology.vertex_neighbours().row(i);
            let share = 0.5 / around.len().max(1) as f64;
            let mut row: Vec<f64> = rows[i].iter().map(|w| 0.5 * w).collect();
            for &n in around {
                row.iter_mut()
                    .zip(&rows[n as usize])
                    .for_each(|(r, w)| *r += share * w);
            }
            row
        });
        rows = next;
    }
    // What four joints cannot show, nobody sees: shares below one in a hundred.
    let kept = rows.into_iter().map(|r| {
        r.into_iter()
            .enumerate()
            .filter(|(_, w)| *w > 0.01)
            .collect()
    });
    SkinWeights::from_rows(kept)
}
