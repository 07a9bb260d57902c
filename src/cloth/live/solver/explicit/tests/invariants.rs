//! Invariants: momentum, energy, drift, and patches against one patch.

use crate::live::solver::explicit::V4;
use crate::live::solver::explicit::mass_filter::MassFilter;
use crate::live::solver::explicit::stable_sheet::ends;
use crate::live::solver::explicit::test_sheets::{
    Lab, cotton, crumpled, distance, grid, sheet, stable_step,
};
use crate::settings::SolverSettings;
use tryon_geometry::math::V3d;

#[test]
fn free_fall_conserves_momentum_to_rounding() {
    let (x, faces, rest) = grid(8, 8, 0.02, 0.02);
    let mut lab = Lab::new(sheet(&faces, &rest, x.len(), &cotton(1e-5)), &x, 2e-4, 1);
    // Crumpled and turning: inner forces must not move the centre of mass.
    let wild: Vec<V3d> = x
        .iter()
        .map(|p| p + V3d::new(0.0, 0.004 * (p.x * 90.0).sin() * (p.z * 70.0).cos(), 0.0))
        .collect();
    let spin: Vec<V3d> = wild
        .iter()
        .map(|p| V3d::new(0.3, 2.0, -1.0).cross(p))
        .collect();
    lab.place(&wild, &spin);
    let masses = lab.sheet.mass.clone();
    let mass: f64 = masses.iter().sum();
    let mean = |v: &[V3d]| {
        let weighted = v.iter().zip(&masses).map(|(v, m)| v * (m / mass));
        weighted.sum::<V3d>()
    };
    let (c0, v0) = (mean(&wild), mean(&spin));
    let n = 2000;
    lab.run(n, &[]);
    let t = n as f64 * lab.h;
    // Symplectic Euler falls g h² n (n + 1) / 2.
    let fall = V3d::new(0.0, -9.81 * lab.h * lab.h * (n * (n + 1)) as f64 / 2.0, 0.0);
    assert!(
        (mean(&lab.positions()) - (c0 + v0 * t + fall)).norm() < 2e-5,
        "{}",
        mean(&lab.positions())
    );
    assert!((mean(&lab.velocities()) - v0 - V3d::new(0.0, -9.81 * t, 0.0)).norm() < 2e-4);
}

#[test]
fn filtered_accelerations_match_double_precision_and_conserve_momentum() {
    // Accelerations of one substep from a crumpled state, against W in f64.
    let (x, faces, rest) = grid(9, 7, 0.02, 0.013);
    let wild = crumpled(&x);
    let h = 1e-4;
    let accelerations = |degree| {
        let s = sheet(&faces, &rest, x.len(), &cotton(1e-5));
        let mut lab = Lab::with_filter(s, &x, h, 1, degree);
        lab.place(&wild, &vec![V3d::zeros(); x.len()]);
        assert_eq!(lab.stable.soft_elements, 0);
        lab.run(1, &[]);
        lab.velocities().iter().map(|v| v / h).collect::<Vec<_>>()
    };
    let (plain, filtered) = (accelerations(0), accelerations(2));
    let s = sheet(&faces, &rest, x.len(), &cotton(1e-5));
    let filter = MassFilter::of_sheet(&s, ends(&s), 2, &SolverSettings::default());
    let most = plain.iter().map(|a| a.norm()).fold(0.0, f64::max);
    for pair in [[0, 1], [1, 2]] {
        let mut expected: Vec<_> = plain
            .iter()
            .map(|a| nalgebra::Vector2::new(a[pair[0]], a[pair[1]]))
            .collect();
        filter.apply(&mut expected);
        for (e, a) in expected.iter().zip(&filtered) {
            assert!(
                (e[0] - a[pair[0]]).abs() + (e[1] - a[pair[1]]).abs() < 2e-5 * most,
                "{e} {a} of {most}"
            );
        }
    }
    let momentum = |a: &[V3d]| a.iter().zip(&s.mass).map(|(a, m)| a * *m).sum::<V3d>();
    let size: f64 = plain.iter().zip(&s.mass).map(|(a, m)| a.norm() * m).sum();
    assert!((momentum(&plain) - momentum(&filtered)).norm() < 1e-5 * size);
}

#[test]
fn patches_agree_to_rounding_and_repeat_their_bits() {
    let (x, faces, rest) = grid(24, 24, 0.02, 0.02);
    let make = |patches| {
        let mut lab = Lab::new(
            sheet(&faces, &rest, x.len(), &cotton(1e-5)),
            &x,
            2e-4,
            patches,
        );
        lab.run(800, &[0, 24]);
        lab.positions()
    };
    let (one, three) = (make(1), make(3));
    let apart = distance(&one, &three);
    assert!(apart < 1e-4, "rounding only: {apart}");
    let again = make(3);
    assert!(three.iter().zip(&again).all(|(a, b)| a == b));
}

#[test]
fn million_substeps_at_rest_neither_drift_nor_gain_energy() {
    let (x, faces, rest) = grid(3, 2, 0.02, 0.02);
    let h = stable_step(&sheet(&faces, &rest, x.len(), &cotton(1e-5)), 2);
    // Air drag: without it the last digit of a velocity adds up over a thousand seconds.
    let mut airy = cotton(1e-5);
    airy.damping = 1.0;
    let mut lab = Lab::new(sheet(&faces, &rest, x.len(), &airy), &x, h, 1);
    lab.gravity = V4::default();
    lab.run(1_000_000, &[]);
    let moved = distance(&lab.positions(), &x);
    assert!(
        moved < 1e-4 && lab.energy() < 1e-9,
        "drift {moved}, energy {}",
        lab.energy()
    );
}

#[test]
fn swinging_sheet_gains_no_energy_at_its_stable_step() {
    for degree in 0..3 {
        let (x, faces, rest) = grid(6, 6, 0.02, 0.02);
        let s = sheet(&faces, &rest, x.len(), &cotton(1e-5));
        let h = stable_step(&s, degree);
        let mut lab = Lab::with_filter(s, &x, h, 1, degree);
        assert!(
            lab.stable.kept_stiffness > 0.999,
            "{}",
            lab.stable.kept_stiffness
        );
        for _ in 0..10 {
            lab.run(10_000, &[0, 6]);
            assert!(lab.energy() < 1e-5, "degree {degree}: {} J", lab.energy());
        }
    }
}

/// `TRYON_LONG_TESTS=1` takes 10⁶ substeps.
#[test]
fn hanging_sheet_does_not_drift() {
    let long = std::env::var_os("TRYON_LONG_TESTS").is_some();
    let (x, faces, rest) = grid(16, 16, 0.02, 0.02);
    let mut airy = cotton(1e-5);
    airy.damping = 4.0;
    for degree in [0, 1] {
        let s = sheet(&faces, &rest, x.len(), &airy);
        let h = stable_step(&s, degree);
        let mut lab = Lab::with_filter(s, &x, h, 1, degree);
        let held = [0, 8, 16];
        lab.run((8.0 / h) as usize, &held);
        let (before, energy) = (lab.positions(), lab.energy());
        let steps = if long { 1_000_000 } else { 50_000 };
        let mut most = f64::NEG_INFINITY;
        for _ in 0..10 {
            lab.run(steps / 10, &held);
            most = most.max(lab.energy());
        }
        let drift = distance(&lab.positions(), &before);
        let speed = lab
            .velocities()
            .iter()
            .map(|v| v.norm())
            .fold(0.0, f64::max);
        assert!(
            drift < 1e-3 && speed < 1e-3 && most < energy + 1e-6,
            "{drift} {speed} {energy} {most}"
        );
    }
}
