//! The solver on small scenes: fall on an obstacle, squeeze, speed, same bits, resume.

use super::test_sheets::{octahedron, resting};
use super::*;
use crate::contact::{ContactMesh, ContactSurface};
use crate::elastic::{BendLaw, ClothModel, ElasticFabric, RestSheet, StretchLaw, Stretching};
use nalgebra::Vector2;
use std::ops::ControlFlow;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;
use tryon_geometry::par::{Par, with_threads};

/// Grid of n × n quads of `size` (m) at height `y`, centred.
fn grid(n: u32, size: f64, y: f64) -> (Vec<V3d>, Vec<Face>) {
    let half = f64::from(n) * 0.5;
    let at = |k: u32| {
        let (i, j) = (f64::from(k % (n + 1)), f64::from(k / (n + 1)));
        V3d::new((i - half) * size, y, (j - half) * size)
    };
    let quad = |q: u32| q / n * (n + 1) + q % n;
    let split = |k: u32| [[k, k + n + 1, k + 1], [k + 1, k + n + 1, k + n + 2]];
    let faces = (0..n * n).flat_map(|q| split(quad(q))).collect();
    ((0..(n + 1) * (n + 1)).map(at).collect(), faces)
}

/// Cloth whose rest shape is flat, of Young's modulus `young` (N/m).
fn cloth(x: &[V3d], faces: &[Face], young: f64) -> OfflineCloth {
    let flat: Vec<_> = x.iter().map(|p| Vector2::new(p.x, -p.z)).collect();
    let rest = RestSheet::flat(faces.to_vec(), &flat).expect("a sheet");
    let fabric = ElasticFabric {
        area_density: 0.2,
        stretch: StretchLaw::Linear(Stretching::isotropic(young, 0.3)),
        bend: BendLaw::isotropic(1e-5, 0.3),
    };
    let model = ClothModel::new(&rest, x.len(), fabric).expect("a model");
    let (mass, gravity) = (model.masses().to_vec(), V3d::new(0.0, -9.81, 0.0));
    OfflineCloth::new(
        mass,
        faces.to_vec(),
        gravity,
        vec![Box::new(ElasticTerm::new(model))],
    )
    .expect("cloth")
}

fn settings() -> OfflineSettings {
    OfflineSettings {
        error_rate: f64::INFINITY,
        ..OfflineSettings::default()
    }
}

/// Crossings of cloth with itself and with the obstacle where it is.
fn crossings(solver: &OfflineSolver<'_>, cloth: &[Face], obstacle: &[Face]) -> usize {
    let state = solver.state();
    let (n, m) = (state.now.x.len(), state.obstacle[0].len());
    let surface = |vertices, faces| ContactSurface { vertices, faces };
    let mesh = ContactMesh::new(surface(n, cloth), surface(m, obstacle)).expect("a mesh");
    let x = state.now.x.iter().chain(&state.obstacle[0]);
    let x: Vec<V3d> = x.copied().collect();
    JoinedSurfaces(&mesh).crossings(Par::Seq, &x).len()
}

#[test]
fn cloth_falls_on_a_spike_without_a_crossing() {
    let (x, faces) = grid(8, 0.02, 0.0);
    let (body, body_faces) = octahedron(V3d::new(0.003, -0.065, 0.002), 0.06);
    let cloth = cloth(&x, &faces, 500.0);
    let state = resting(&x, &body);
    let mut solver =
        OfflineSolver::new(&cloth, &body_faces, state, settings(), Par::Seq).expect("solver");
    for frame in 0..12 {
        let report = solver
            .advance(1.0 / 60.0, &FrameTargets::default())
            .expect("a frame");
        assert!(report.largest_give < 1e-3, "{report:?}");
        assert_eq!(crossings(&solver, &faces, &body_faces), 0, "frame {frame}");
    }
    let lowest = solver
        .state()
        .now
        .x
        .iter()
        .map(|p| p.y)
        .fold(f64::INFINITY, f64::min);
    assert!(lowest < -0.02, "it hangs over the spike: {lowest}");
}

#[test]
fn a_fast_body_carries_cloth_along() {
    let (x, faces) = grid(6, 0.02, 0.0);
    let (body, body_faces) = octahedron(V3d::new(0.003, -0.065, 0.002), 0.06);
    let cloth = cloth(&x, &faces, 500.0);
    let state = resting(&x, &body);
    let mut solver =
        OfflineSolver::new(&cloth, &body_faces, state, settings(), Par::Seq).expect("solver");
    let up: Vec<V3d> = body
        .iter()
        .map(|p| p + V3d::new(0.0, 10.0 / 60.0, 0.0))
        .collect();
    let targets = FrameTargets {
        obstacle: &up,
        ..FrameTargets::default()
    };
    solver.advance(1.0 / 60.0, &targets).expect("a frame");
    assert_eq!(crossings(&solver, &faces, &body_faces), 0);
    let highest = solver.state().now.x.iter().map(|p| p.y).fold(0.0, f64::max);
    assert!(highest > 0.1, "{highest}");
}

#[test]
fn cloth_between_obstacles_that_overlap_stays_whole() {
    let (x, faces) = grid(4, 0.02, 0.0);
    let (mut body, mut body_faces) = grid(2, 0.06, -0.004);
    let (upper, more) = grid(2, 0.06, 0.004);
    body_faces.extend(more.iter().map(|f| f.map(|v| v + 9)));
    body.extend(upper);
    let cloth = cloth(&x, &faces, 500.0);
    let state = resting(&x, &body);
    let mut solver =
        OfflineSolver::new(&cloth, &body_faces, state, settings(), Par::Seq).expect("solver");
    // The plates pass each other by 8 mm.
    let shut = body.iter().map(|p| V3d::new(p.x, -2.0 * p.y, p.z));
    let shut: Vec<V3d> = shut.map(|p| V3d::new(p.x, p.y * 0.5, p.z)).collect();
    let targets = FrameTargets {
        obstacle: &shut,
        ..FrameTargets::default()
    };
    for _ in 0..3 {
        let report = solver.advance(1.0 / 60.0, &targets).expect("a frame");
        assert_eq!(crossings(&solver, &faces, &body_faces), 0, "{report:?}");
        assert!(report.largest_give > 3e-3, "the skin gave {report:?}");
    }
}

#[test]
fn frames_have_the_same_bits_at_any_thread_count_and_after_a_resume() {
    let (x, faces) = grid(8, 0.02, 0.0);
    let (body, body_faces) = octahedron(V3d::new(0.003, -0.065, 0.002), 0.06);
    let cloth = cloth(&x, &faces, 500.0);
    let start = |par| {
        let state = resting(&x, &body);
        OfflineSolver::new(&cloth, &body_faces, state, settings(), par).expect("solver")
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
    let (x, faces) = grid(3, 0.02, 0.0);
    let cloth = cloth(&x, &faces, 500.0);
    let mut solver =
        OfflineSolver::new(&cloth, &[], resting(&x, &[]), settings(), Par::Seq).expect("solver");
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
fn a_static_drape_comes_to_rest() {
    let (x, faces) = grid(6, 0.02, 0.0);
    let (body, body_faces) = octahedron(V3d::new(0.003, -0.065, 0.002), 0.06);
    let cloth = cloth(&x, &faces, 500.0);
    let mut all = settings();
    all.contact = Some(ContactSettings {
        friction: 0.9,
        ..ContactSettings::default()
    });
    let mut solver =
        OfflineSolver::new(&cloth, &body_faces, resting(&x, &body), all, Par::Seq).expect("solver");
    let drape = DrapeSettings {
        most_steps: 12,
        ..DrapeSettings::default()
    };
    let report = solver
        .drape(&drape, |_| ControlFlow::Continue(()))
        .expect("a drape");
    assert!(report.steps > 2 && report.motion.is_finite(), "{report:?}");
    assert_eq!(crossings(&solver, &faces, &body_faces), 0);
    assert!(solver.state().now.v.iter().all(|v| *v == V3d::zeros()));
}

#[test]
fn stiffness_over_six_decades_is_solved() {
    for young in [1.0, 1e2, 1e4, 1e6] {
        let (x, faces) = grid(5, 0.02, 0.0);
        let (body, body_faces) = octahedron(V3d::new(0.003, -0.065, 0.002), 0.06);
        let cloth = cloth(&x, &faces, young);
        let state = resting(&x, &body);
        let mut solver =
            OfflineSolver::new(&cloth, &body_faces, state, settings(), Par::Seq).expect("solver");
        for _ in 0..4 {
            let report = solver.advance(1.0 / 60.0, &FrameTargets::default());
            assert!(report.is_ok(), "{young} N/m: {report:?}");
        }
        assert_eq!(crossings(&solver, &faces, &body_faces), 0, "{young} N/m");
    }
}

#[test]
fn faults_of_the_input_are_named() {
    let (x, faces) = grid(2, 0.02, 0.0);
    let cloth = cloth(&x, &faces, 500.0);
    let solver = |state| OfflineSolver::new(&cloth, &[], state, settings(), Par::Seq).map(|_| ());
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
