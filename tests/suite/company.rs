//! Tracking with other people and objects in the picture, with mounted cameras, and with skipped work.

use std::sync::Arc;
use tryon::body::Template;
use tryon::formats::shared_data;
use tryon::geometry::camera::NoiseModel;
use tryon::geometry::math::P3d;
use tryon::synth::{Actor, Routine, Sequence, Setting};
use tryon::tracking::{ConfidenceReason, TrackerConfig};
use tryon_bench::DepthScene;
use tryon_bench::scenes;
use tryon_bench::tracking::{TrackOutcome, follow, mean};

/// An actor alone in the dark, without colour.
fn alone() -> Setting {
    Setting {
        room: None,
        noise: NoiseModel::KinectV1,
        color: false,
        seed: 3,
        ..Setting::default()
    }
}

fn scene(setting: Setting, frames: u64) -> (Arc<Template>, DepthScene) {
    let actor = Actor::default();
    (
        actor.template.clone(),
        DepthScene::synthetic("actor", &Sequence::new(actor, setting), frames),
    )
}

fn track(template: &Arc<Template>, scene: &DepthScene) -> TrackOutcome {
    follow(
        template,
        &TrackerConfig::default(),
        scene,
        |_, _, _, _, _| {},
    )
}

/// Outcome, number of joints that `measured` selects, and their mean error (mm).
fn track_joints(
    template: &Arc<Template>,
    scene: &DepthScene,
    measured: impl Fn(usize) -> bool,
) -> (TrackOutcome, usize, f64) {
    let out = track(template, scene);
    let errors = out.per_joint_mm.iter().enumerate();
    let errors: Vec<f64> = errors
        .filter(|(j, _)| measured(*j))
        .map(|(_, e)| *e)
        .collect();
    (out, errors.len(), mean(&errors))
}

fn error_of(out: &TrackOutcome, scene: &DepthScene, parts: &[&str]) -> f64 {
    let of = |part: &&str| {
        out.per_joint_mm[scene
            .joint_names
            .iter()
            .position(|n| n == part)
            .expect("joint")]
    };
    mean(&parts.iter().map(of).collect::<Vec<_>>())
}

const UPPER: [&str; 8] = [
    "spine3",
    "neck",
    "head",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "pelvis",
];

/// A passer-by, out to the side and back, at `z` metres from the camera.
fn passer_by(z: f64, frames: u64) -> DepthScene {
    let setting = Setting {
        routine: Routine::LeaveAndReturn,
        home: P3d::new(-1.7, 0.0, -z),
        seed: 9,
        ..alone()
    };
    scene(setting, frames).1
}

#[test]
fn tracking_stays_on_its_subject_when_someone_passes() {
    for (z, most) in [(3.6, 12.0), (1.8, 25.0)] {
        let (template, mut own) = scene(alone(), 170);
        let clean = mean(&track(&template, &own).joints_mm);
        let passer = passer_by(z, 170);
        let across: Vec<f64> = passer
            .truth
            .iter()
            .filter_map(|t| t.joints.first())
            .map(|p| p.x)
            .collect();
        let (from, to) = (across[0], across[across.len() - 1]);
        assert!(
            from * to < 0.0,
            "the passer-by crosses the picture's middle: {from:.2} to {to:.2} m"
        );
        let seen = own.frames[112].depth.clone();
        own = own.with(&passer);
        let hidden = seen
            .data()
            .iter()
            .zip(own.frames[112].depth.data())
            .filter(|(a, b)| **a > 0 && a != b)
            .count();
        let config = TrackerConfig::default();
        let mut farthest = 0.0f64;
        let out = follow(&template, &config, &own, |i, model, state, _, workspace| {
            if state.status.is_live() {
                let (_, bones) = workspace.posed(model, state);
                let off = bones.joints[0] - own.truth[i].joints[0];
                farthest = farthest.max(off.norm());
            }
        });
        let (all, end) = (
            mean(&out.joints_mm),
            mean(&out.joints_mm[out.joints_mm.len() - 10..]),
        );
        eprintln!(
            "someone passes at {z} m: {all:.1} mm ({clean:.1} alone), {end:.1} at the end, lost {}, farthest {farthest:.2} m, {hidden} pixels hidden",
            out.lost
        );
        assert!(end < clean + 10.0, "at {z} m: {end:.1} mm at the end");
        assert!(farthest < 0.3, "at {z} m: live {farthest:.2} m off");
        if z > 2.4 {
            assert!(
                all < most && out.lost == 0,
                "behind: {all:.1} mm, lost {}",
                out.lost
            );
        }
    }
}

#[test]
fn a_held_object_costs_little_accuracy() {
    let (template, own) = scene(alone(), 120);
    let clean = mean(&track(&template, &own).joints_mm);
    let holding = own.holding("left_wrist", 0.09);
    let out = track(&template, &holding);
    let (all, body) = (mean(&out.joints_mm), error_of(&out, &holding, &UPPER));
    let arm = error_of(&out, &holding, &["left_elbow", "left_wrist"]);
    eprintln!(
        "a ball of 18 cm in the hand: {all:.1} mm ({clean:.1} without), upper body {body:.1}, its arm {arm:.1}"
    );
    assert!(all < clean + 10.0 && body < 12.0 && arm < 75.0 && out.lost == 0);
}

#[test]
fn legs_without_depth_leave_the_upper_body_accurate_and_are_flagged() {
    let setting = Setting {
        room: Some(Default::default()),
        ..alone()
    };
    let (template, own) = scene(setting, 120);
    let mut bare = own;
    for side in ["left", "right"] {
        bare = bare.without_return(&format!("{side}_hip"), &format!("{side}_knee"), 0.15);
        bare = bare.without_return(&format!("{side}_knee"), &format!("{side}_ankle"), 0.12);
    }
    let knee = template.skeleton().index("left_knee").expect("joint");
    let mut flagged = 0;
    let out = follow(
        &template,
        &TrackerConfig::default(),
        &bare,
        |i, _, state, report, _| {
            let reason = report.confidence.get(knee).map(|c| c.reason);
            flagged += usize::from(
                i >= 30 && state.status.is_live() && reason != Some(ConfidenceReason::Measured),
            );
        },
    );
    let (upper, legs) = (
        error_of(&out, &bare, &UPPER),
        error_of(&out, &bare, &["left_knee", "right_knee"]),
    );
    eprintln!(
        "black trousers: upper body {upper:.1} mm, knees {legs:.1}, knee flagged in {flagged} of 90, lost {}",
        out.lost
    );
    assert!(upper < 15.0 && out.lost == 0 && flagged >= 80);
}

/// Row `facing_counter` of the reports: everything below row 260 of 480 is a counter at 0.9 m.
#[test]
fn a_counter_before_the_legs_turns_nobody_around() {
    let setting = Setting {
        room: Some(Default::default()),
        ..alone()
    };
    let (template, mut scene) = scene(setting, 30);
    for frame in &mut scene.frames {
        let (width, height) = (frame.depth.width() as usize, frame.depth.height() as usize);
        frame.depth.data_mut()[height * 260 / 480 * width..].fill(900);
    }
    let side = |name: &str| template.skeleton().index(name).expect("joint");
    let shoulders = [side("left_shoulder"), side("right_shoulder")];
    let mut reversed = 0;
    let config = TrackerConfig::default();
    follow(
        &template,
        &config,
        &scene,
        |_, model, state, _, workspace| {
            let (_, bones) = workspace.posed(model, state);
            let [left, right] = shoulders.map(|j| bones.joints[j].x);
            reversed += usize::from(state.status.is_live() && left < right);
        },
    );
    assert_eq!(
        reversed, 0,
        "live frames in which the body is turned around"
    );
}

#[test]
fn tilted_rolled_and_portrait_cameras_track_alike() {
    let tilted = |down: f64, roll: f64| Setting {
        world_from_camera: Setting::tilted(1.1, down, roll),
        ..alone()
    };
    let roomy = |s: Setting| Setting {
        room: Some(Default::default()),
        ..s
    };
    let cases = [
        ("level", roomy(tilted(0.0, 0.0))),
        ("rolled by 8°", roomy(tilted(3.0, 8.0))),
        ("rolled by 8°, no floor in view", tilted(0.0, 8.0)),
        ("tilted down by 15°", roomy(tilted(15.0, 0.0))),
        ("portrait", roomy(tilted(0.0, 0.0)).portrait()),
        ("portrait, rolled by 5°", roomy(tilted(2.0, 5.0)).portrait()),
    ];
    // No floor is looked for there: its plane is taken for a wall.
    let turned = [
        ("on its side", roomy(tilted(2.0, 90.0))),
        ("on its other side", roomy(tilted(2.0, -90.0))),
        ("upside down", roomy(tilted(2.0, 180.0))),
    ];
    let cases = cases
        .map(|(name, setting)| (name, setting, 12.0))
        .into_iter();
    let turned = turned.map(|(name, setting)| (name, setting, 25.0));
    for (name, setting, most) in cases.chain(turned) {
        let (template, own) = scene(setting, 75);
        let out = track(&template, &own);
        let error = mean(&out.joints_mm);
        eprintln!(
            "{name}: {error:.1} mm, found {:?}, lost {}",
            out.found, out.lost
        );
        assert!(
            error < most && out.lost == 0 && out.found.is_some_and(|f| f < 15),
            "{name}: {error:.1} mm"
        );
    }
}

#[test]
fn half_a_person_in_the_picture_is_tracked() {
    // An arm out of the picture from the first frame on; all right of the breastbone missing after the start.
    let beside = scene(
        Setting {
            home: P3d::new(1.15, 0.0, -2.4),
            ..alone()
        },
        90,
    );
    let roomy = scene(
        Setting {
            room: Some(Default::default()),
            ..alone()
        },
        120,
    );
    for (name, (template, own), share) in [
        ("arm", beside, 1.0),
        ("half", (roomy.0, roomy.1.cut_beside(0.5, 40)), 0.5),
    ] {
        let camera = own.calibration.depth;
        let edge = share * f64::from(camera.width);
        let always = |j: usize| {
            own.truth
                .iter()
                .all(|t| t.joints[j].x / t.joints[j].z * camera.fx + camera.cx < edge - 10.0)
        };
        let (out, inside, error) = track_joints(&template, &own, always);
        eprintln!(
            "{name} out of view: {} of 22 joints inside, {error:.1} mm, lost {}",
            inside, out.lost
        );
        assert!(
            (5..22).contains(&inside),
            "{name}: the scene cuts the person: {}",
            inside
        );
        assert!(
            error < 20.0 && out.lost == 0 && out.found == Some(0),
            "{name}: {error:.1} mm, lost {}",
            out.lost
        );
    }
}

/// The side of the picture cuts the body through the middle from the first frame on, in a room and in the dark.
#[test]
fn a_person_cut_by_the_side_from_the_start_is_found() {
    for (name, room) in [("dark", None), ("room", Some(Default::default()))] {
        let (template, own) = scene(
            Setting {
                home: P3d::new(1.42, 0.0, -2.4),
                room,
                ..alone()
            },
            75,
        );
        let camera = own.calibration.depth;
        let always = |j: usize| {
            let column = |p: &P3d| p.x / p.z * camera.fx + camera.cx;
            let columns = 10.0..f64::from(camera.width) - 10.0;
            own.truth
                .iter()
                .all(|t| columns.contains(&column(&t.joints[j])))
        };
        let (out, inside, error) = track_joints(&template, &own, always);
        eprintln!(
            "half cut off, {name}: {} of 22 joints inside, {error:.1} mm, found {:?}",
            inside, out.found
        );
        assert!(
            (5..18).contains(&inside),
            "{name}: the scene cuts the person: {}",
            inside
        );
        assert!(
            error < 8.0 && out.found == Some(0) && out.lost == 0,
            "{name}: {error:.1} mm, {:?}",
            out.found
        );
    }
}

/// Skipped work changes joints and displaced surface by less than a bound, millimetres on average. An unhurried routine
/// skips coarse iterations, a fast dance converges late.
#[test]
fn each_skip_keeps_its_bound() {
    let all = TrackerConfig::default();
    let coarse = TrackerConfig {
        skip_coarse: false,
        ..all
    };
    let mut settled = all;
    settled.shape.surface.settled = 0.0;
    let converged = TrackerConfig {
        converged: 0.0,
        ..all
    };
    let (template, calm) = scene(
        Setting {
            room: Some(Default::default()),
            ..alone()
        },
        160,
    );
    compare_skips(
        &template,
        &calm,
        &[
            ("coarse iterations", coarse, 2.5, 3.0),
            ("settled displacements", settled, 1e-6, 0.5),
        ],
    );
    let unchanged = TrackerConfig {
        skip_unchanged: false,
        ..all
    };
    let (template, still) = scene(
        Setting {
            routine: Routine::Still,
            room: Some(Default::default()),
            ..alone()
        },
        160,
    );
    compare_skips(
        &template,
        &still,
        &[("unchanged frames", unchanged, 2.0, 2.0)],
    );
    let (Some(folder), Some(data)) = (
        shared_data("sequences/charleston_m_heavy_tof_room"),
        shared_data("."),
    ) else {
        return;
    };
    let template = scenes::subject(&data, "template").expect("template");
    let mut dance = DepthScene::open(&folder).expect("scene");
    dance.frames.truncate(110);
    dance.truth.truncate(110);
    let mut searches = all;
    searches.registration.reuse = 0.0;
    compare_skips(
        &template,
        &dance,
        &[
            ("converged iterations", converged, 3.0, 3.0),
            ("searches of converged bones", searches, 1.5, 1.5),
        ],
    );
}

fn compare_skips(
    template: &Arc<Template>,
    own: &DepthScene,
    cases: &[(&str, TrackerConfig, f64, f64)],
) {
    let run = |config: &TrackerConfig| {
        let (mut tracks, mut done) = (vec![], [0usize; 5]);
        let out = follow(
            template,
            config,
            own,
            |i, model, state, report, workspace| {
                let skipped = &report.skipped;
                let counts = [
                    skipped.coarse_iterations,
                    skipped.displacements,
                    skipped.iterations,
                    skipped.frames,
                    skipped.searches,
                ];
                done.iter_mut().zip(counts).for_each(|(d, c)| *d += c);
                if i >= 75 {
                    let (vertices, bones) = workspace.posed(model, state);
                    tracks.push((bones.joints, vertices.to_vec()));
                }
            },
        );
        (tracks, done, mean(&out.joints_mm))
    };
    let (with, skipped, error) = run(&TrackerConfig::default());
    for (name, config, joints_bound, surface_bound) in cases {
        let (without, less, other) = run(config);
        let (mut joints, mut surface) = (vec![], vec![]);
        for (a, b) in with.iter().zip(&without) {
            joints.extend(a.0.iter().zip(&b.0).map(|(p, q)| (p - q).norm() * 1e3));
            surface.extend(
                a.1.iter()
                    .zip(&b.1)
                    .map(|(p, q)| f64::from((p - q).norm()) * 1e3),
            );
        }
        let (joints, surface) = (mean(&joints), mean(&surface));
        eprintln!(
            "{name} skipped ({skipped:?} against {less:?}): joints {joints:.3} mm apart, surface {surface:.3}; error {error:.1} against {other:.1} mm"
        );
        assert!(
            skipped.iter().zip(&less).any(|(a, b)| a > b),
            "{name}: something is left out"
        );
        assert!(
            joints <= *joints_bound && surface <= *surface_bound,
            "{name}: {joints:.2}, {surface:.2} mm"
        );
    }
}

#[test]
fn limb_recovery_finds_an_arm_lost_at_low_rate() {
    let (Some(folder), Some(data)) = (
        shared_data("sequences/jacks_f_avg_kinect1_room"),
        shared_data("."),
    ) else {
        return;
    };
    let template = scenes::subject(&data, "template").expect("template");
    let own = DepthScene::open(&folder).expect("scene").every(4);
    let error = |rescue| {
        let config = TrackerConfig {
            rescue,
            ..TrackerConfig::default().without_doubt()
        };
        mean(&follow(&template, &config, &own, |_, _, _, _, _| {}).joints_mm)
    };
    let (without, with) = (error(false), error(true));
    eprintln!(
        "jumping jacks at 7.5 frames a second: {with:.1} mm, {without:.1} without looking for the arm"
    );
    assert!(with < 16.0 && with < without);
}
