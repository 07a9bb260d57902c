//! Momentum of free cloth: a thrown sheet follows a parabola, and two that collide keep the sum.

use super::sheets::{GRAVITY, PlanarSheet, assert_free, converged, isotropic, resting};
use super::*;
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Mean of a field, weighted by mass.
fn centre(mass: &[f64], of: &[V3d]) -> V3d {
    let sum: V3d = mass.iter().zip(of).map(|(m, p)| p * *m).sum();
    sum / mass.iter().sum::<f64>()
}

/// Angular momentum about the centre of mass (kg m²/s).
fn spin(mass: &[f64], state: &MotionState) -> V3d {
    let (x, v) = (centre(mass, &state.x), centre(mass, &state.v));
    let all = mass.iter().zip(state.x.iter().zip(&state.v));
    all.map(|(m, (p, q))| (p - x).cross(&(q - v)) * *m).sum()
}

/// Sheet thrown with a spin and a bulge: the centre of mass falls by ½ g t², whatever the cloth does.
/// Returns the distance from the parabola (m) and the share of the spin that is lost.
fn throw(settings: OfflineSettings) -> [f64; 2] {
    let sheet = PlanarSheet::grid([6, 6], [0.02, 0.02]);
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let x = sheet.at_height(0.0);
    let mut state = resting(&x, &[]);
    for (p, v) in x.iter().zip(&mut state.now.v) {
        *v = V3d::new(1.0, 2.0, 0.5) + V3d::new(0.0, 6.0, 2.0).cross(p);
        v.y += 20.0 * (p.x * p.x - p.z * p.z);
    }
    let mass = &cloth.mass;
    let [begin, speed] = [centre(mass, &x), centre(mass, &state.now.v)];
    let first = spin(mass, &state.now);
    let mut solver = OfflineSolver::new(&cloth, &[], state, settings, Par::Seq).expect("solver");
    for _ in 0..12 {
        let targets = FrameTargets::default();
        solver.advance(1.0 / 60.0, &targets).expect("a frame");
    }
    let end = solver.state();
    let fall = V3d::new(0.0, -0.5 * GRAVITY * end.time * end.time, 0.0);
    let off = centre(mass, &end.now.x) - (begin + speed * end.time + fall);
    let lost = (spin(mass, &end.now) - first).norm() / first.norm();
    [off.norm(), lost]
}

/// The first step is implicit Euler's, off by g h²/2; even steps of BDF2 make that ¾ g h² and are exact themselves. Spin
/// is lost to second order.
#[test]
fn a_thrown_sheet_follows_a_parabola() {
    let lost = [1.0 / 60.0, 1.0 / 240.0].map(|h| {
        let [off, lost] = throw(OfflineSettings {
            longest_step: h,
            error_rate: f64::INFINITY,
            newton: converged(),
            ..OfflineSettings::default()
        });
        let expected = 0.75 * GRAVITY * h * h;
        assert!((off / expected - 1.0).abs() < 0.01, "{h} s: {off} m");
        lost
    });
    assert!(lost[0] < 0.02 && lost[1] < lost[0] / 12.0, "{lost:?}");
}

/// Two patches meet at an angle, with friction and without gravity.
fn collide(newton: NewtonSettings) -> f64 {
    let patch = PlanarSheet::grid([4, 4], [0.01, 0.01]);
    let mut both = patch.clone();
    both.append(&patch);
    let lower = patch.at_height(0.0);
    let upper = patch.at_height(4e-3);
    let shifted = upper.iter().map(|p| p + V3d::new(0.003, 0.0, 0.007));
    let x: Vec<V3d> = lower.iter().copied().chain(shifted).collect();
    let cloth = both.cloth_in(isotropic(500.0, 0.3, 1e-5), V3d::zeros());
    let mut state = resting(&x, &[]);
    for (i, v) in state.now.v.iter_mut().enumerate() {
        *v = if i < lower.len() {
            V3d::new(0.3, 0.5, 0.0)
        } else {
            V3d::new(0.0, -0.5, 0.2)
        };
    }
    let before = centre(&cloth.mass, &state.now.v);
    let settings = OfflineSettings {
        newton,
        error_rate: f64::INFINITY,
        ..OfflineSettings::default()
    };
    let mut solver = OfflineSolver::new(&cloth, &[], state, settings, Par::Seq).expect("solver");
    for _ in 0..6 {
        let targets = FrameTargets::default();
        solver.advance(1.0 / 120.0, &targets).expect("a frame");
        assert_free(&solver, [&both.faces, &[]]);
    }
    let end = &solver.state().now;
    let apart: f64 = (0..25)
        .map(|i| end.x[25 + i].y - end.x[i].y)
        .fold(f64::INFINITY, f64::min);
    assert!(apart > 0.0, "they do not pass through each other");
    (centre(&cloth.mass, &end.v) - before).norm()
}

#[test]
fn two_sheets_that_collide_keep_their_momentum() {
    let change = collide(converged());
    assert!(change < 1e-6, "{change} m/s");
}
