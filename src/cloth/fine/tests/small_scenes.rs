//! The solver on small scenes: squeeze, stiffness, same bits, resume.

use super::sheets::{PlanarSheet, assert_free, isotropic, octahedron, resting};
use super::stress::coarse;
use super::*;
use std::ops::ControlFlow;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;
use tryon_geometry::par::{Par, with_threads};

/// Sheet of n × n squares of 20 mm, and an octahedron under its middle.
fn sheet_over_spike(n: u32) -> (PlanarSheet, Vec<V3d>, Vec<Face>) {
    let (body, faces) = octahedron(V3d::new(0.003, -0.065, 0.002), 0.06);
    (PlanarSheet::grid([n; 2], [0.02; 2]), body, faces)
}

#[test]
fn cloth_between_obstacles_that_overlap_stays_whole() {
    let sheet = PlanarSheet::grid([4; 2], [0.02; 2]);
    let mut plates = PlanarSheet::grid([2; 2], [0.06; 2]);
    plates.append(&plates.clone());
    let place = |lower: f64, upper: f64| -> Vec<V3d> {
        let mut x = plates.at_height(lower);
        x[9..].iter_mut().for_each(|p| p.y = upper);
        x
    };
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let state = resting(&sheet.at_height(0.0), &place(-4e-3, 4e-3));
    let mut solver =
        OfflineSolver::new(&cloth, &plates.faces, state, coarse(), Par::Seq).expect("solver");
    // The plates pass each other by 8 mm.
    let shut = place(4e-3, -4e-3);
    let targets = FrameTargets {
        obstacle: &shut,
        ..FrameTargets::default()
    };
    for _ in 0..3 {
        let report = solver.advance(1.0 / 60.0, &targets).expect("a frame");
        assert_free(&solver, [&sheet.faces, &plates.faces]);
        assert!(report.largest_give > 3e-3, "the skin gave {report:?}");
    }
}

#[test]
fn frames_have_the_same_bits_at_any_thread_count_and_after_a_resume() {
    let (sheet, body, faces) = sheet_over_spike(8);
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let start = |par| {
        let state = resting(&sheet.at_height(0.0), &body);
        OfflineSolver::new(&cloth, &faces, state, coarse(), par).expect("solver")
    };
    let run = |par| {
        let mut solver = start(par);
        let mut saved = Vec::new();
        let last = solver
            .animate(
                1.0 / 60.0,
                1..=8,
                |_| FrameTargets::default(),
                |done, solver| {
                    if done.frame == 5 {
                        saved = solver.checkpoint(5);
                    }
                    ControlFlow::Continue(())
                },
            )
            .expect("frames");
        assert_eq!(last, 8);
        (solver.state().clone(), saved)
    };
    let (whole, saved) = run(Par::Seq);
    let threads = with_threads(3, || run(Par::Rayon)).expect("threads");
    assert!(threads.0 == whole && threads.1 == saved);

    let mut resumed = start(Par::Seq);
    let frame = resumed.resume(&saved).expect("a checkpoint") as usize;
    resumed
        .animate(
            1.0 / 60.0,
            frame + 1..=8,
            |_| FrameTargets::default(),
            |_, _| ControlFlow::Continue(()),
        )
        .expect("frames");
    assert!(*resumed.state() == whole);

    let mut damaged = saved.clone();
    damaged[100] ^= 1;
    assert!(matches!(
        resumed.resume(&damaged),
        Err(OfflineError::Checkpoint(_))
    ));
    assert!(resumed.resume(&saved[..40]).is_err());
    assert!(*resumed.state() == whole);
}

#[test]
fn an_animation_breaks_off_where_it_is_told() {
    let sheet = PlanarSheet::grid([3; 2], [0.02; 2]);
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let state = resting(&sheet.at_height(0.0), &[]);
    let mut solver = OfflineSolver::new(&cloth, &[], state, coarse(), Par::Seq).expect("solver");
    let last = solver.animate(
        0.01,
        1..=9,
        |_| FrameTargets::default(),
        |done, _| {
            assert!(done.seconds.iter().all(|s| *s >= 0.0));
            if done.frame == 2 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        },
    );
    assert_eq!(last, Ok(2));
}

#[test]
fn stiffness_over_six_decades_is_solved() {
    for young in [1.0, 1e2, 1e4, 1e6] {
        let (sheet, body, faces) = sheet_over_spike(5);
        let cloth = sheet.cloth(isotropic(young, 0.3, 1e-5));
        let state = resting(&sheet.at_height(0.0), &body);
        let mut solver =
            OfflineSolver::new(&cloth, &faces, state, coarse(), Par::Seq).expect("solver");
        for _ in 0..4 {
            let report = solver.advance(1.0 / 60.0, &FrameTargets::default());
            assert!(report.is_ok(), "{young} N/m: {report:?}");
        }
        assert_free(&solver, [&sheet.faces, &faces]);
    }
}

#[test]
fn faults_of_the_input_are_named() {
    let sheet = PlanarSheet::grid([2; 2], [0.02; 2]);
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let x = sheet.at_height(0.0);
    let solver = |state| OfflineSolver::new(&cloth, &[], state, coarse(), Par::Seq).map(|_| ());
    let short = resting(&x[1..], &[]);
    assert!(matches!(
        solver(short),
        Err(OfflineError::Input {
            field: "positions",
            ..
        })
    ));
    let mut wild = resting(&x, &[]);
    wild.now.v[3].y = f64::NAN;
    let fault = solver(wild).expect_err("a fault").to_string();
    assert_eq!(fault, "velocities: vertex 3 is not finite");
    let massless = OfflineCloth::new(vec![0.0], Vec::new(), V3d::zeros(), Vec::new());
    assert!(massless.is_err());
}
