//! Drift over long sessions: mean joints of late rounds against those of early ones.
//!
//! `TRYON_LONG_TESTS=1` runs the long forms: 100,000 frames back and forth.

use crate::tracked::{fixed_size, joints, long, own_body, recorded, template};
use tryon::geometry::camera::{NoiseModel, RgbdFrame};
use tryon::synth::Routine;
use tryon::tracking::{TrackerConfig, TrackerModel, TrackerState, Workspace, step};
use tryon_bench::tracking::mean;

/// Rounds whose mean is a joint's position.
///
/// Paths of one round alternate by up to a millimetre (a foot's tip changes its pairs), which is no drift.
const ROUNDS_AVERAGED: u64 = 10;

/// Shows `frames` pictures back and forth. Compares the mean joints of the last ten rounds with those of the ten after
/// `settle` rounds, picture by picture of a round.
///
/// Returns the drift of the worst joint and of all on average, metres, and of the worst angle, radians. `creep` may spoil
/// the state after each frame.
fn drift(
    model: &TrackerModel,
    pictures: &[RgbdFrame],
    frames: u64,
    settle: u64,
    mut creep: impl FnMut(&mut TrackerState, u64),
) -> (f64, f64, f64) {
    let length = 2 * pictures.len() as u64;
    let rounds = frames / length;
    assert!(
        rounds >= settle + 2 * ROUNDS_AVERAGED,
        "{rounds} rounds are too few"
    );
    let mut state = TrackerState::new(model);
    let mut workspace = Workspace::default();
    let (n, dofs) = (
        model.template().skeleton().len(),
        model.template().skeleton().dofs(),
    );
    let zero = (vec![nalgebra::Vector3::zeros(); n], vec![0.0; dofs]);
    let mut sums = [
        vec![zero.clone(); length as usize],
        vec![zero; length as usize],
    ];
    for i in 0..rounds * length {
        let (round, k) = (i / length, (i % length) as usize);
        let picture = &pictures[k.min(length as usize - 1 - k)];
        let frame = RgbdFrame {
            sequence: i,
            time_ns: i * 33_333_333,
            ..picture.clone()
        };
        step(model, &mut state, &frame, &mut workspace).expect("step");
        creep(&mut state, i);
        let early = (settle..settle + ROUNDS_AVERAGED).contains(&round);
        let late = round >= rounds - ROUNDS_AVERAGED;
        if early || late {
            assert!(state.status.is_live(), "frame {i}: {:?}", state.status);
            let (joint_sums, angle_sums) = &mut sums[usize::from(late)][k];
            joint_sums
                .iter_mut()
                .zip(joints(model, &state))
                .for_each(|(s, j)| *s += j.coords);
            angle_sums
                .iter_mut()
                .zip(&state.pose.angles)
                .for_each(|(s, a)| *s += a);
        }
    }
    let r = state.pose.root.iso().rotation.to_rotation_matrix();
    let skew = (r.matrix().transpose() * r.matrix() - nalgebra::Matrix3::identity()).norm();
    assert!(skew < 1e-12, "the root's rotation is off by {skew:.1e}");
    let (mut worst, mut all, mut turned) = (0.0f64, vec![], 0.0f64);
    for (early, late) in sums[0].iter().zip(&sums[1]) {
        let joints = early
            .0
            .iter()
            .zip(&late.0)
            .map(|(a, b)| (a - b).norm() / ROUNDS_AVERAGED as f64);
        all.extend(joints.clone());
        worst = joints.fold(worst, f64::max);
        let turn = early
            .1
            .iter()
            .zip(&late.1)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        turned = turned.max(turn / ROUNDS_AVERAGED as f64);
    }
    (worst, mean(&all), turned)
}

/// The bar is half a millimetre in 100,000 frames. The short form compares means 2,400 frames apart and may show as much,
/// which a creep of 2·10⁻⁷ m a frame would exceed.
const DRIFT: f64 = 0.5e-3;

#[test]
fn long_sessions_do_not_drift() {
    let (template, scene) = own_body(Routine::TryOn, NoiseModel::None, 30);
    let frames: u64 = if long() { 100_000 } else { 3_600 };
    let model = TrackerModel::new(template, scene.calibration.clone(), fixed_size());
    let (off, _, turned) = drift(&model, &scene.frames, frames, 10, |_, _| {});
    eprintln!(
        "{frames} frames back and forth: drift {:.4} mm, {turned:.1e} rad",
        off * 1e3
    );
    assert!(off < DRIFT, "{:.3} mm", off * 1e3);
}

/// The measure must be able to fail: bones that grow by two millionths a frame, a millimetre in half a minute on a leg, are
/// caught, while a bias of 10⁻⁵ rad in every angle after every frame is measured away again and again.
#[test]
fn a_planted_creep_is_caught() {
    let (template, scene) = own_body(Routine::TryOn, NoiseModel::None, 30);
    let joints = template.skeleton().len();
    let model = TrackerModel::new(template, scene.calibration.clone(), fixed_size());
    let grows = |state: &mut TrackerState, i: u64| {
        state.shape.bone_scales = vec![1.0 + 2e-6 * i as f64; joints]
    };
    let (off, ..) = drift(&model, &scene.frames, 2_400, 10, grows);
    eprintln!(
        "bones that grow by 2·10⁻⁶ a frame: {:.3} mm in 2,400 frames",
        off * 1e3
    );
    assert!(
        off > DRIFT,
        "a creep of bones passes for none: {:.3} mm",
        off * 1e3
    );
    let biased =
        |state: &mut TrackerState, _: u64| state.pose.angles.iter_mut().for_each(|a| *a += 1e-5);
    let (off, ..) = drift(&model, &scene.frames, 2_400, 10, biased);
    eprintln!(
        "every angle biased by 10⁻⁵ rad a frame: {:.4} mm",
        off * 1e3
    );
    assert!(off < DRIFT, "a bias adds up: {:.3} mm", off * 1e3);
}

/// The whole tracker (size, displacements with their running mean and variance) on a recorded dance. Displacements are
/// fitted at intervals that do not divide the round, so no two rounds are the same, and the tips of fast hands wander among
/// several answers by millimetres: here the mean over joints and pictures is held to the bar.
#[test]
fn long_sessions_with_displacements_do_not_drift() {
    let (Some(template), Some(scene)) = (template(), recorded(60)) else {
        return;
    };
    let frames: u64 = if long() { 100_000 } else { 2_400 };
    let model = TrackerModel::new(
        template,
        scene.calibration.clone(),
        TrackerConfig::default(),
    );
    // Size and shape are done after 60 frames, displacements have their temporal term after 20 updates.
    let (worst, off, turned) = drift(&model, &scene.frames[40..], frames, 30, |_, _| {});
    let (worst, off_mm) = (worst * 1e3, off * 1e3);
    eprintln!(
        "{frames} recorded frames back and forth: drift {off_mm:.4} mm, worst {worst:.3}, {turned:.1e} rad"
    );
    assert!(off < DRIFT, "{off_mm:.3} mm");
}
