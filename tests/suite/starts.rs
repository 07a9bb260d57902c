//! Starts from nothing in poses that are no calibration pose: a kick, a lifted knee, hands on the hips.

use crate::tracked::{bones, frame, picture};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::PI;
use tryon::body::{Pose, embedded};
use tryon::geometry::camera::{Calibration, Intrinsics};
use tryon::geometry::math::{Camera, Rigid};
use tryon::tracking::{TrackerConfig, TrackerModel, TrackerState, Workspace, step};

/// Angles of named joints: a rotation vector each, or one number for a hinge, radians.
type Angles<'a> = [(&'a str, &'a [f64])];

/// Mean error of the joints `of` after three frames, millimetres.
///
/// The subject stands 2.5 m away, turned by `yaw` radians, with the given angles of named joints.
fn mean_error_mm(angles: &Angles<'_>, yaw: f64, of: &[&str]) -> f64 {
    let template = embedded::template();
    let skeleton = template.skeleton();
    let rest = template.personalise(&Default::default());
    let facing = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
        * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), yaw);
    let middle = rest.joints[0].coords;
    let root = Rigid::from_parts(Vector3::new(0.0, 0.1, 2.5) - facing * middle, facing);
    let mut pose: Pose<Camera> = Pose::rest(skeleton, root);
    for (joint, values) in angles {
        assert!(skeleton.index(joint).is_some(), "{joint}");
        pose.set(skeleton, joint, values);
    }
    pose.clamp_to_limits(skeleton);
    let truth = bones(&template, &rest, &pose).joints;
    let camera = Intrinsics::KINECT_V1;
    let depth = picture(&template, camera, &pose);
    let model = TrackerModel::new(
        template.clone(),
        Calibration::registered(camera),
        TrackerConfig::default(),
    );
    let mut state = TrackerState::new(&model);
    let mut workspace = Workspace::default();
    for i in 0..3u64 {
        let frame = frame(i, depth.clone());
        step(&model, &mut state, &frame, &mut workspace).expect("a step");
    }
    assert!(
        state.status.is_live(),
        "{angles:?} at {yaw}: {:?}",
        state.status
    );
    let (_, found) = workspace.posed(&model, &state);
    let off = |j: &&str| {
        let j = skeleton.index(j).expect("a joint");
        (found.joints[j] - truth[j]).norm() * 1e3
    };
    of.iter().map(off).sum::<f64>() / of.len() as f64
}

const LEGS: [&str; 6] = [
    "left_hip",
    "right_hip",
    "left_knee",
    "right_knee",
    "left_ankle",
    "right_ankle",
];
const ARMS: [&str; 6] = [
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
];

/// Name of a pose, its angles, and the joints that are compared.
type StartPose = (
    &'static str,
    &'static Angles<'static>,
    &'static [&'static str],
);

const POSES: [StartPose; 12] = [
    (
        "knee lifted",
        &[("left_hip", &[-1.4, 0.0, 0.0]), ("left_knee", &[1.5])],
        &LEGS,
    ),
    ("kick", &[("right_hip", &[-1.2, 0.0, 0.0])], &LEGS),
    ("leg aside", &[("right_hip", &[0.0, 0.0, -0.6])], &LEGS),
    (
        "hand to the front",
        &[
            ("left_shoulder", &[-1.2, 0.0, -0.5]),
            ("left_elbow", &[1.0]),
        ],
        &ARMS,
    ),
    ("high kick", &[("right_hip", &[-1.9, 0.0, 0.0])], &LEGS),
    ("leg far aside", &[("right_hip", &[0.0, 0.0, -1.2])], &LEGS),
    (
        "foot behind",
        &[("right_hip", &[0.3, 0.0, 0.0]), ("right_knee", &[1.8])],
        &LEGS,
    ),
    (
        "lunge",
        &[
            ("right_hip", &[-1.3, 0.0, 0.0]),
            ("right_knee", &[1.4]),
            ("left_hip", &[0.4, 0.0, 0.0]),
            ("left_knee", &[0.7]),
        ],
        &LEGS,
    ),
    (
        "seated",
        &[
            ("right_hip", &[-1.5, 0.0, 0.0]),
            ("right_knee", &[1.5]),
            ("left_hip", &[-1.5, 0.0, 0.0]),
            ("left_knee", &[1.5]),
        ],
        &LEGS,
    ),
    (
        "flamingo",
        &[("left_hip", &[0.0, 0.8, 1.0]), ("left_knee", &[2.0])],
        &LEGS,
    ),
    (
        "hands behind head",
        &[
            ("left_shoulder", &[0.0, 0.0, 1.3]),
            ("left_elbow", &[2.2]),
            ("right_shoulder", &[0.0, 0.0, -1.3]),
            ("right_elbow", &[2.2]),
        ],
        &ARMS,
    ),
    (
        "arms crossed",
        &[
            ("left_shoulder", &[-0.6, 0.8, -0.5]),
            ("left_elbow", &[1.9]),
            ("right_shoulder", &[-0.9, -0.8, 0.5]),
            ("right_elbow", &[1.9]),
        ],
        &ARMS,
    ),
];
/// Lifted knees, kicks, seats and crossed arms are found in the first picture.
///
/// Two of the thirty-six are not: a shank hidden behind its thigh, and a knee turned out on the far side.
#[test]
fn a_start_needs_no_calibration_pose() {
    let mut found = 0;
    let mut all = 0;
    for (name, angles, of) in POSES {
        for yaw in [0.0, 0.5, -0.9] {
            let off = mean_error_mm(angles, yaw, of);
            println!("{name}, turned by {yaw}: {off:.0} mm");
            all += 1;
            found += u32::from(off < 25.0);
        }
    }
    assert!(all == 36 && found >= 34, "{found} of {all}");
}

/// Front and back of a standing body differ by little more than feet and the bend of the arms.
#[test]
fn a_subject_seen_from_behind_is_found_facing_away() {
    for yaw in [PI, PI - 0.5, PI + 0.6] {
        for of in [&ARMS, &LEGS] {
            let off = mean_error_mm(&[], yaw, of);
            assert!(off < 40.0, "turned by {yaw}: {off} mm");
        }
    }
}
