//! Fusion of exact views of a rigid, posed body, from poses that are off.

use super::frame_points::camera_points;
use super::key_frames::{KeyFrame, KeyFrames};
use super::{TurnConfig, TurnError, TurnTracker, fuse};
use crate::align::start::scan_frame;
use crate::scan::{BodyScan, bounds};
use crate::segment::BodyRegion;
use crate::settings::PersonSearchSettings;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::{PI, TAU};
use tryon_body::{BodyShape, BoneTransforms, Pose, embedded, skin};
use tryon_geometry::camera::{Calibration, DepthImage, Intrinsics, RgbdFrame};
use tryon_geometry::math::{P3, Rigid, World};
use tryon_geometry::par::Par;
use tryon_geometry::spatial::Bvh;
use tryon_tracking::still::VirtualCamera;

/// Views of a body that stands with arms half raised, and its true surface as the camera faces it.
fn views(count: usize) -> (KeyFrames, Vec<P3>) {
    let template = embedded::template();
    let rest = template.personalise(&BodyShape::default());
    let posed = |yaw: f64, shift: Vector3<f64>| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), yaw);
        let mut pose = Pose::<World>::rest(template.skeleton(), Rigid::from_parts(shift, turn));
        pose.set(template.skeleton(), "left_elbow", &[0.4]);
        let mut bones = BoneTransforms::default();
        pose.bones(template.skeleton(), &rest, &mut bones);
        let mut vertices = Vec::new();
        let weights = template.weights();
        skin(Par::Seq, &rest.vertices, weights, &bones, &mut vertices);
        (pose, vertices)
    };
    let truth = posed(0.0, Vector3::zeros()).1;
    let camera = VirtualCamera::around(bounds(&truth, 0.002), 0.0);
    let camera_from_world = camera.world_from_camera.inverse();
    let config = TurnConfig::default();
    let frame = |k: usize| {
        let yaw = k as f64 / count as f64 * TAU;
        let yaw = if yaw > PI { yaw - TAU } else { yaw };
        let points = posed(yaw, Vector3::zeros()).1;
        let scan = BodyScan {
            points,
            faces: template.mesh().faces().to_vec(),
            ..BodyScan::default()
        };
        let image = scan_frame(&camera, &scan, &PersonSearchSettings::default());
        // Tracked poses lean on what faces the camera, and are late by a degree.
        let off = if k == 0 { 0.0 } else { 0.01 };
        let (pose, vertices) = posed(yaw - 2.0 * off, Vector3::new(0.3 * off, 0.0, off));
        let mut near = Vec::new();
        camera_from_world.points_f32(&vertices, &mut near);
        KeyFrame {
            frame: k,
            yaw,
            quality: 1.0,
            pose: Pose {
                root: camera_from_world * pose.root,
                angles: pose.angles,
            },
            points: camera_points(&image, &camera.calibration, &near, None, &config.points),
        }
    };
    let keys = KeyFrames {
        frames: (0..count).map(frame).collect(),
        shape: BodyShape::default(),
        world_from_camera: camera.world_from_camera,
        count,
        live: count,
    };
    (keys, truth)
}

fn mean_distance(points: &[P3], surface: &[P3]) -> f32 {
    let bvh = Bvh::new(embedded::template().mesh().faces(), surface);
    let closest = points.iter().filter_map(|p| bvh.closest(surface, p));
    closest.map(|c| c.distance).sum::<f32>() / points.len().max(1) as f32
}

#[test]
fn views_all_around_meet_on_the_surface() {
    let template = embedded::template();
    let (keys, truth) = views(12);
    let tracked = TurnConfig {
        iterations: 0,
        ..TurnConfig::default()
    };
    let before = fuse(&template, &keys, &tracked).expect("fused");
    let after = fuse(&template, &keys, &TurnConfig::default()).expect("fused");
    let [off, near] = [&before, &after].map(|f| mean_distance(&f.scan.points, &truth));
    assert!(near < 0.002 && near < 0.5 * off, "{off} to {near}");
    assert!(after.report.is_whole_turn && after.report.unseen.is_empty());
    assert_eq!(after.report.reference, 0);
}

#[test]
fn one_view_is_a_scan_of_one_side() {
    let template = embedded::template();
    let (keys, truth) = views(1);
    let fused = fuse(&template, &keys, &TurnConfig::default()).expect("fused");
    assert!(mean_distance(&fused.scan.points, &truth) < 0.002);
    assert_eq!(fused.report.yaw_coverage_degrees, 0.0);
    assert!(!fused.report.is_whole_turn);
    assert!(!fused.report.unseen.contains(&BodyRegion::Chest));
}

#[test]
fn regions_out_of_the_picture_are_unseen() {
    let template = embedded::template();
    let (mut keys, _) = views(4);
    for key in &mut keys.frames {
        // Rows below the waist; the camera's y points down.
        let scan = &mut key.points;
        let keep: Vec<bool> = scan.points.iter().map(|p| p.y < 0.0).collect();
        let mut kept = keep.iter();
        scan.points.retain(|_| *kept.next().unwrap_or(&false));
        let mut kept = keep.iter();
        scan.normals.retain(|_| *kept.next().unwrap_or(&false));
    }
    let fused = fuse(&template, &keys, &TurnConfig::default()).expect("fused");
    let unseen = fused.report.unseen;
    assert!(unseen.contains(&BodyRegion::Shin) && unseen.contains(&BodyRegion::Foot));
    assert!(!unseen.contains(&BodyRegion::Chest), "{unseen:?}");
}

#[test]
fn recordings_without_frames_or_people_are_refused() {
    let tracker = || {
        let calibration = Calibration::registered(Intrinsics::KINECT_V1);
        TurnTracker::new(embedded::template(), calibration)
    };
    assert_eq!(tracker().finish().expect_err("empty"), TurnError::Empty);
    let frame = RgbdFrame {
        sequence: 0,
        time_ns: 0,
        depth: DepthImage::empty(640, 480),
        color: None,
    };
    let mut alone = tracker();
    alone.step(&frame).expect("fits");
    let fault = alone.finish().expect_err("nobody");
    assert_eq!(fault, TurnError::Nobody { frames: 1 });
    let small = RgbdFrame {
        depth: DepthImage::empty(2, 2),
        ..frame
    };
    let refused = tracker().step(&small).expect_err("another size");
    assert!(matches!(refused, TurnError::Frame { frame: 0, .. }));
}
