//! Failure cases before a camera, with the thresholds that tracking is held to.
//!
//! `TRYON_LONG_TESTS=1` runs the long forms: 1,000 starts, 100,000 random pictures.

use crate::tracked::{
    data, fixed_size, frame, joints, long, own_body, picture, quiet, recorded, template,
};
use tryon::body::Pose;
use tryon::geometry::camera::{Calibration, DepthImage, Intrinsics, NoiseModel};
use tryon::geometry::math::{P3d, Rigid};
use tryon::synth::Routine;
use tryon::tracking::{
    ConfidenceReason, LostReason, Status, TrackerConfig, TrackerModel, TrackerState, Workspace,
    step,
};
use tryon_bench::tracking::{follow, mean};
use tryon_bench::{DepthScene, scenes};

#[test]
fn lost_and_corrupt_pixels_cost_little() {
    let (Some(template), Some(scene)) = (template(), recorded(80)) else {
        return;
    };
    let error = |s: &DepthScene| mean(&quiet(&template, s).joints_mm);
    let clean = error(&scene);
    let [half, most] = [0.5, 0.9].map(|share| error(&scene.clone().thinned(share)));
    let [few, tenth] = [0.02, 0.1].map(|share| error(&scene.clone().corrupted(share)));
    eprintln!(
        "clean {clean:.1} mm; lost 50 %: {half:.1}, 90 %: {most:.1}; corrupt 2 %: {few:.1}, 10 %: {tenth:.1}"
    );
    assert!(half <= 1.4 * clean && most <= 2.0 * clean);
    assert!(
        few <= 1.2 * clean && tenth <= 1.2 * clean,
        "a start in a corrupt picture included"
    );
}

#[test]
fn almost_nothing_left_does_not_diverge() {
    let (Some(template), Some(scene)) = (template(), recorded(75)) else {
        return;
    };
    let mut spoilt = scene.clone().thinned(0.98);
    for i in (0..40).chain(60..75) {
        spoilt.frames[i] = scene.frames[i].clone();
    }
    let mut last = 0.0;
    let out = follow(
        &template,
        &TrackerConfig::default(),
        &spoilt,
        |_, _, state, _, _| {
            assert!(state.pose.is_finite());
        },
    );
    if let Some(e) = out.joints_mm.get(70 - 30) {
        last = *e;
    }
    eprintln!("ten frames after 98 % were lost: {last:.1} mm");
    assert!(last < 20.0, "{last:.1} mm");
}

#[test]
fn empty_frames_lose_and_find_again() {
    let (Some(template), Some(scene)) = (template(), recorded(105)) else {
        return;
    };
    let usual = mean(&quiet(&template, &scene).joints_mm);
    for gap in [1usize, 5, 15, 30] {
        let blind = scene.clone().blind(50..50 + gap);
        let mut kept: Option<Pose> = None;
        let out = follow(
            &template,
            &TrackerConfig::default(),
            &blind,
            |i, _, state, report, _| {
                if (50..50 + gap).contains(&i) {
                    assert_eq!(
                        state.status,
                        Status::Lost {
                            reason: LostReason::NoPerson
                        },
                        "frame {i}"
                    );
                    let kept = kept.get_or_insert(state.pose.clone());
                    assert_eq!(
                        (report.pose_age as usize, &state.pose),
                        (i - 49, &*kept),
                        "the last good pose is kept, with its age"
                    );
                }
            },
        );
        // Blind frames have no truth, so the tenth frame after the gap stands ten after frame 50.
        let back = out.joints_mm[50 - 30 + 10];
        eprintln!(
            "{gap} empty frames: {back:.1} mm ten frames later, {usual:.1} on average without"
        );
        assert!(back < 10.0 + usual, "{gap} empty frames: {back:.1} mm");
    }
}

#[test]
fn dropped_frames_cost_little() {
    let (template, scene) = own_body(Routine::TryOn, NoiseModel::KinectV1, 200);
    for (n, most) in [(2, 6.0), (3, 10.0), (4, 12.0)] {
        let out = follow(
            &template,
            &fixed_size(),
            &scene.clone().every(n),
            |_, _, _, _, _| {},
        );
        let error = mean(&out.joints_mm);
        eprintln!("every {n}. frame: {error:.1} mm, lost {}", out.lost);
        assert!(
            error < most && out.lost == 0,
            "every {n}. frame: {error:.1} mm"
        );
    }
}

#[test]
fn a_torso_turns_seen_from_the_waist_up() {
    let (Some(data), Some(template)) = (data(), template()) else {
        return;
    };
    let scene = scenes::scene(&data, "turn_upper").expect("a scene");
    let at = |name: &str| {
        scene
            .joint_names
            .iter()
            .position(|n| n == name)
            .expect("joint")
    };
    let (left, right) = (at("left_shoulder"), at("right_shoulder"));
    let ours = |n: &str| template.skeleton().index(n).expect("joint");
    let (ours_left, ours_right) = (ours("left_shoulder"), ours("right_shoulder"));
    let mut worst = 0.0f64;
    let mut flagged = true;
    let out = follow(
        &template,
        &TrackerConfig::default(),
        &scene,
        |i, model, state, report, _| {
            if i < 30 {
                return;
            }
            let j = joints(model, state);
            let yaw = |d: nalgebra::Vector3<f64>| d.z.atan2(d.x);
            let t = &scene.truth[i].joints;
            let off = yaw(j[ours_left] - j[ours_right]) - yaw(t[left] - t[right]);
            worst = worst.max(off.sin().abs().asin());
            flagged &= report.confidence[ours("left_ankle")].reason != ConfidenceReason::Measured;
        },
    );
    let named: Vec<(String, f64)> = scene
        .joint_names
        .iter()
        .cloned()
        .zip(out.per_joint_mm.clone())
        .collect();
    let of = |n: &str| {
        named
            .iter()
            .find(|(m, _)| m == n)
            .map_or(f64::NAN, |(_, e)| *e)
    };
    eprintln!(
        "pelvis {:.1}, spine {:.1} {:.1} {:.1} mm, yaw off by {:.1}° at most, lost {}",
        of("pelvis"),
        of("spine1"),
        of("spine2"),
        of("spine3"),
        worst.to_degrees(),
        out.lost
    );
    assert!(
        ["pelvis", "spine1", "spine2", "spine3"]
            .iter()
            .all(|n| of(n) <= 20.0)
    );
    assert!(worst.to_degrees() <= 15.0 && flagged && out.lost == 0);
}

/// The paper's other failure: an arm whose sleeve gives no return, in the dark and before a wall. The hand beyond it
/// does, and determines the arm.
#[test]
fn an_arm_without_return_follows_its_hand() {
    let (Some(template), Some(data)) = (template(), data()) else {
        return;
    };
    for name in ["arm_without_return", "arm_without_return_room"] {
        let mut scene = scenes::scene(&data, name).expect("a scene");
        scene.frames.truncate(100);
        let out = quiet(&template, &scene);
        let of = |joint: &str| {
            out.per_joint_mm[scene
                .joint_names
                .iter()
                .position(|n| n == joint)
                .expect("joint")]
        };
        let (elbow, wrist, all) = (of("left_elbow"), of("left_wrist"), mean(&out.joints_mm));
        eprintln!(
            "{}: elbow {elbow:.0}, wrist {wrist:.0}, joints {all:.1} mm",
            scene.name
        );
        assert!(
            elbow < 70.0 && wrist < 45.0 && all < 16.0 && out.lost == 0,
            "{}: {elbow} {wrist} {all}",
            scene.name
        );
    }
}

#[test]
fn the_lower_half_may_be_missing() {
    let (Some(template), Some(scene)) = (template(), recorded(100)) else {
        return;
    };
    let cut = scene.cut_below(0.55);
    let limits = template.skeleton().limits();
    let out = follow(
        &template,
        &TrackerConfig::default(),
        &cut,
        |i, _, state, _, _| {
            for (a, l) in state.pose.angles.iter().zip(&limits) {
                assert!(
                    *a >= l[0] - 1e-9 && *a <= l[1] + 1e-9,
                    "frame {i}: {a} beyond {l:?}"
                );
            }
        },
    );
    let upper = [
        "spine3",
        "neck",
        "head",
        "left_shoulder",
        "right_shoulder",
        "left_elbow",
        "right_elbow",
    ];
    let of =
        |n: &&str| out.per_joint_mm[cut.joint_names.iter().position(|m| m == n).expect("joint")];
    let error = mean(&upper.iter().map(of).collect::<Vec<_>>());
    eprintln!("upper joints {error:.1} mm, lost {}", out.lost);
    assert!(error < 10.0 && out.lost == 0, "{error:.1} mm");
}

#[test]
fn straight_limbs_and_an_arm_along_the_view_are_steady() {
    let template = tryon::body::embedded::template();
    let skeleton = template.skeleton();
    let camera = Intrinsics::KINECT_V1;
    let facing = nalgebra::UnitQuaternion::from_axis_angle(
        &nalgebra::Vector3::x_axis(),
        std::f64::consts::PI,
    );
    let pelvis = skeleton.joints()[0].rest.coords;
    let at = nalgebra::Vector3::new(0.0, 0.05, 2.4) - facing * pelvis;
    let mut pose: Pose = Pose::rest(skeleton, Rigid::from_parts(at, facing));
    // The left arm straight at the camera.
    let (s, e) = (
        skeleton.index("left_shoulder").expect("joint"),
        skeleton.index("left_elbow").expect("joint"),
    );
    let along = skeleton.joints()[e].rest - skeleton.joints()[s].rest;
    let turn = nalgebra::UnitQuaternion::rotation_between(&along, &nalgebra::Vector3::z())
        .expect("a turn");
    pose.set(skeleton, "left_shoulder", turn.scaled_axis().as_slice());
    pose.clamp_to_limits(skeleton);
    let depth = picture(&template, camera, &pose);
    let model = TrackerModel::new(
        template.clone(),
        Calibration::registered(camera),
        fixed_size(),
    );
    let mut state = TrackerState::new(&model);
    let mut workspace = Workspace::default();
    let mut before = None;
    let (mut jitter, mut turned) = (0.0f64, 0.0f64);
    for i in 0..40u64 {
        let frame = frame(i, depth.clone());
        step(&model, &mut state, &frame, &mut workspace).expect("step");
        assert!(state.status.is_live());
        let now = joints(&model, &state);
        if let Some((old, angles)) = before {
            let old: Vec<P3d> = old;
            let angles: Vec<f64> = angles;
            let moved = old
                .iter()
                .zip(&now)
                .map(|(a, b)| (a - b).norm())
                .fold(0.0, f64::max);
            let angle = state
                .pose
                .angles
                .iter()
                .zip(&angles)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            turned = turned.max(angle);
            if i >= 20 {
                jitter = jitter.max(moved);
            }
        }
        before = Some((now, state.pose.angles.clone()));
    }
    eprintln!(
        "static picture: {:.2} mm from frame to frame, {turned:.2} rad at most",
        jitter * 1e3
    );
    assert!(turned < 0.5 && jitter < 1.5e-3);
}

#[test]
fn a_rough_start_settles() {
    use rand::{Rng, SeedableRng};
    let (template, scene) = own_body(Routine::Still, NoiseModel::KinectV1, 10);
    let seeds = if long() { 1000 } else { 12 };
    let model = TrackerModel::new(template.clone(), scene.calibration.clone(), fixed_size());
    let mut workspace = Workspace::default();
    let (mut good, mut at_once) = (0, 0);
    for seed in 0..seeds {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(seed);
        let mut random = |scale: f64| (rng.random::<f64>() * 2.0 - 1.0) * scale;
        let mut state = TrackerState::new(&model);
        let root = scene.truth[0].joints[0].coords;
        let shift = nalgebra::Vector3::new(random(0.15), random(0.15), random(0.15)) / 3f64.sqrt();
        state.start_at(&model, root + shift, random(30f64.to_radians()));
        state
            .pose
            .angles
            .iter_mut()
            .for_each(|a| *a += random(20f64.to_radians()));
        state.pose.clamp_to_limits(template.skeleton());
        for (i, frame) in scene.frames.iter().enumerate() {
            step(&model, &mut state, frame, &mut workspace).expect("step");
            at_once += u64::from(i == 0 && state.status.is_live());
        }
        let j = joints(&model, &state);
        let names = &scene.joint_names;
        let ours = names
            .iter()
            .map(|n| j[template.skeleton().index(n).expect("joint")]);
        let off: Vec<f64> = ours
            .zip(&scene.truth[9].joints)
            .map(|(a, b)| (a - b).norm() * 1e3)
            .collect();
        good += u32::from(state.status.is_live() && mean(&off) < 10.0);
    }
    eprintln!("{good} of {seeds} rough starts are below 10 mm after ten frames");
    assert!(f64::from(good) >= 0.95 * seeds as f64, "{good} of {seeds}");
    assert_eq!(at_once, seeds, "live in the first frame");
}

#[test]
fn random_pictures_never_panic() {
    use rand::{Rng, SeedableRng};
    let template = tryon::body::embedded::template();
    let camera = Intrinsics {
        width: 160,
        height: 120,
        fx: 131.0,
        fy: 131.0,
        cx: 79.5,
        cy: 59.5,
    };
    let model = TrackerModel::new(
        template,
        Calibration::registered(camera),
        TrackerConfig::default(),
    );
    let mut state = TrackerState::new(&model);
    let mut workspace = Workspace::default();
    let mut rng = rand_pcg::Pcg32::seed_from_u64(3);
    for i in 0..if long() { 100_000u64 } else { 60 } {
        let (a, b): (u16, u16) = (rng.random(), rng.random_range(1..4000));
        let (u0, v0) = (rng.random_range(0..120u32), rng.random_range(0..60u32));
        let blob = rng.random::<bool>();
        let pixel = |k: u32| {
            let (u, v) = (k % 160, k / 160);
            // Noise, or an upright block with a rough surface that may pass for somebody.
            if blob {
                if u > u0 && u < u0 + 40 && v > v0 {
                    1500 + (k * u32::from(a) % 97) as u16
                } else {
                    0
                }
            } else {
                (k.wrapping_mul(u32::from(a)) % u32::from(b)) as u16
            }
        };
        let depth = DepthImage::new(160, 120, (0..160 * 120).map(pixel).collect()).expect("size");
        let frame = frame(i, depth);
        step(&model, &mut state, &frame, &mut workspace).expect("step");
        assert!(state.pose.is_finite() && state.shape.coefficients.iter().all(|c| c.is_finite()));
    }
}
