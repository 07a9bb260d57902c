//! Faults as the caller meets them: no solution, tangled starts, wrong settings and targets.

use super::sheets::{PlanarSheet, isotropic, octahedron, pinned, resting};
use super::stress::{FRAME, coarse, run, still};
use super::*;
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// A step that ends with an error names its vertex and leaves positions, velocities and time.
#[test]
fn a_step_without_solution_changes_nothing() {
    let sheet = PlanarSheet::grid([4, 4], [0.02, 0.02]);
    let (body, faces) = octahedron(V3d::new(0.003, -0.061, 0.002), 0.06);
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let state = resting(&sheet.at_height(0.0), &body);
    let solver = |settings| {
        OfflineSolver::new(&cloth, &faces, state.clone(), settings, Par::Seq).expect("solver")
    };
    let mut hasty = coarse();
    hasty.halvings = 2;
    hasty.newton.iterations = 1;
    hasty.newton.tolerance = 0.0;
    let mut starved = solver(hasty);
    match starved.advance(FRAME, &FrameTargets::default()) {
        Err(OfflineError::Unsolved { time, step, why }) => {
            assert!(time == 0.0 && (step * 4.0 / FRAME - 1.0).abs() < 1e-9);
            assert!(matches!(why, NewtonFault::Iterations { vertex, .. } if vertex < 31));
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(*starved.state(), state);

    let pins = [PinTarget {
        vertex: 7,
        target: V3d::new(0.0, f64::NAN, 0.0),
    }];
    let mut lost = solver(coarse());
    run(&mut lost, [&sheet.faces, &faces], 3, still);
    let before = lost.state().clone();
    let targets = pinned(&pins);
    let fault = lost.advance(FRAME, &targets).expect_err("a fault");
    let expected = NewtonFault::NotFinite { vertex: 7 };
    assert!(
        matches!(fault, OfflineError::Unsolved { why, .. } if why == expected),
        "{fault}"
    );
    let after = lost.state();
    assert_eq!(after.now, before.now);
    assert_eq!(
        (after.time, &after.obstacle),
        (before.time, &before.obstacle)
    );
}

/// Rounding decides of energies near zero, so the line search shortens a motion that is none.
#[test]
fn cloth_at_rest_without_load_is_solved() {
    let sheet = PlanarSheet::grid([10, 3], [0.005, 0.0066]);
    let cloth = sheet.cloth_in(isotropic(500.0, 0.0, 1e-5), V3d::zeros());
    let state = resting(&sheet.at_height(0.0), &[]);
    let mut solver = OfflineSolver::new(&cloth, &[], state, coarse(), Par::Seq).expect("solver");
    run(&mut solver, [&sheet.faces, &[]], 3, still);
}

/// A two-step method needs the state one step earlier to go on with the same bits.
#[test]
fn a_step_without_solution_keeps_the_earlier_state() {
    let sheet = PlanarSheet::grid([4, 4], [0.02, 0.02]);
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let state = resting(&sheet.at_height(0.0), &[]);
    let mut solver = OfflineSolver::new(&cloth, &[], state, coarse(), Par::Seq).expect("solver");
    run(&mut solver, [&sheet.faces, &[]], 3, still);
    let before = solver.state().clone();
    let pins = [PinTarget {
        vertex: 7,
        target: V3d::new(0.0, f64::NAN, 0.0),
    }];
    let targets = pinned(&pins);
    assert!(solver.advance(FRAME, &targets).is_err());
    assert_eq!(*solver.state(), before);
}

/// Cloth that begins with a spike through it never comes free by itself.
#[test]
fn a_tangled_start_is_refused() {
    let sheet = PlanarSheet::grid([4, 4], [0.02, 0.02]);
    let (body, faces) = octahedron(V3d::new(0.003, -0.05, 0.002), 0.06);
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let state = resting(&sheet.at_height(0.0), &body);
    let refused =
        OfflineSolver::new(&cloth, &faces, state, coarse(), Par::Seq).and_then(|mut s| {
            let targets = FrameTargets::default();
            s.advance(FRAME, &targets).map(|_| ())
        });
    let fault = refused.expect_err("a fault");
    assert!(
        matches!(fault, OfflineError::IntersectingStart { .. }),
        "{fault}"
    );
}

/// Settings and targets come from files: none of them may panic or be ignored.
#[test]
fn wrong_settings_and_targets_are_named() {
    let sheet = PlanarSheet::grid([3, 3], [0.02, 0.02]);
    let (body, faces) = octahedron(V3d::new(0.003, -0.065, 0.002), 0.06);
    let cloth = sheet.cloth(isotropic(500.0, 0.0, 1e-5));
    let refuse = |settings: OfflineSettings, duration: f64, targets: &FrameTargets<'_>| {
        let state = resting(&sheet.at_height(0.0), &body);
        let solver = OfflineSolver::new(&cloth, &faces, state, settings, Par::Seq);
        let end = solver.and_then(|mut s| s.advance(duration, targets).map(|_| ()));
        assert!(matches!(end, Err(OfflineError::Input { .. })), "{end:?}");
    };
    let none = FrameTargets::default();
    let far = [PinTarget {
        vertex: 700,
        target: V3d::zeros(),
    }];
    let pins = pinned(&far);
    let fewer = FrameTargets {
        pins: &[],
        obstacle: &body[1..],
    };
    for duration in [0.0, -0.1, f64::NAN] {
        refuse(coarse(), duration, &none);
    }
    for longest_step in [0.0, -1.0, f64::NAN] {
        refuse(
            OfflineSettings {
                longest_step,
                ..coarse()
            },
            FRAME,
            &none,
        );
    }
    refuse(
        OfflineSettings {
            halvings: 70,
            ..coarse()
        },
        FRAME,
        &none,
    );
    refuse(coarse(), FRAME, &pins);
    refuse(coarse(), FRAME, &fewer);
}
