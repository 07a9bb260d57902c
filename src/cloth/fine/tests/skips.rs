//! Skips of the solver: queries by a margin, steps by an error estimate, regions that sleep. Each can be switched off, and is
//! bounded.

use super::sheets::{PlanarSheet, assert_free, converged, isotropic, octahedron, pinned, resting};
use super::*;
use std::ops::ControlFlow;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;

fn root_mean_square(a: &[V3d], b: &[V3d]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum();
    (sum / a.len() as f64).sqrt()
}

/// Fall on a spike with this margin; positions, queries and reuses.
fn fall(margin: f64) -> (Vec<V3d>, [usize; 2]) {
    let sheet = PlanarSheet::grid([8, 8], [0.02, 0.02]);
    let (body, faces) = octahedron(V3d::new(0.003, -0.065, 0.002), 0.06);
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let mut settings = OfflineSettings {
        error_rate: f64::INFINITY,
        newton: converged(),
        ..OfflineSettings::default()
    };
    settings.contact = Some(ContactSettings {
        margin,
        ..ContactSettings::default()
    });
    let state = resting(&sheet.at_height(0.0), &body);
    let mut solver = OfflineSolver::new(&cloth, &faces, state, settings, Par::Seq).expect("solver");
    let mut counts = [0; 2];
    for _ in 0..8 {
        let report = solver.advance(1.0 / 60.0, &FrameTargets::default());
        let contact = report.expect("a frame").contact;
        counts[0] += contact.queries;
        counts[1] += contact.reused;
        assert_free(&solver, [&sheet.faces, &faces]);
    }
    (solver.state().now.x.clone(), counts)
}

/// Candidates beyond the barrier's reach add nothing, so a margin changes the rounding of a step at most.
#[test]
fn reused_candidates_change_nothing_that_shows() {
    let (without, [queries, _]) = fall(0.0);
    for margin in [1e-3, 5e-3] {
        let (with, [fewer, reused]) = fall(margin);
        let apart = root_mean_square(&with, &without);
        assert!(
            fewer < queries && reused > 0,
            "{fewer} of {queries}, {reused}"
        );
        assert!(apart < 1e-5, "margin {margin}: {apart} m");
    }
}

/// Square that swings from two corners for 0.25 s.
fn swing(change: impl Fn(&mut OfflineSettings)) -> (Vec<V3d>, usize) {
    let sheet = PlanarSheet::grid([8, 8], [0.025, 0.025]);
    let x = sheet.at_height(0.0);
    let cloth = sheet.cloth(isotropic(200.0, 0.3, 1e-5));
    let mut settings = OfflineSettings {
        newton: converged(),
        contact: None,
        ..OfflineSettings::default()
    };
    change(&mut settings);
    let state = resting(&x, &[]);
    let mut solver = OfflineSolver::new(&cloth, &[], state, settings, Par::Seq).expect("solver");
    let pins = [0, 8].map(|v| PinTarget {
        vertex: v,
        target: x[v as usize],
    });
    let targets = pinned(&pins);
    let mut steps = 0;
    for _ in 0..15 {
        steps += solver.advance(1.0 / 60.0, &targets).expect("a frame").steps;
    }
    (solver.state().now.x.clone(), steps)
}

/// Local errors of at most r h add up to r T, while neighbouring motions keep their distance; stiff modes, which the
/// estimate leaves out, add as much again at most.
#[test]
fn adaptive_steps_stay_within_their_error_rate() {
    let (exact, most) = swing(|s| {
        s.longest_step = 1.0 / 1920.0;
        s.error_rate = f64::INFINITY;
    });
    for rate in [0.08, 0.02, 0.005] {
        let (adaptive, steps) = swing(|s| s.error_rate = rate);
        let apart = root_mean_square(&adaptive, &exact);
        assert!(steps < most / 2, "{steps} of {most}");
        assert!(apart < 2.0 * 0.25 * rate, "rate {rate}: {apart} m");
    }
}

/// Sheet on a table; corners of the table.
fn table() -> (PlanarSheet, Vec<V3d>, Vec<Face>) {
    let at = |k: u32| V3d::new(f64::from(k % 2) - 0.5, -9e-4, 0.5 - f64::from(k / 2));
    let faces = vec![[0, 1, 2], [1, 3, 2]];
    (
        PlanarSheet::grid([20, 4], [0.02, 0.02]),
        (0..4).map(at).collect(),
        faces,
    )
}

/// Sum of the vertices that slept in frames in which an end of the sheet is pushed up and let down.
fn wave(solver: &mut OfflineSolver<'_>, frames: std::ops::Range<u32>) -> usize {
    let sheet = table().0;
    let x = sheet.at_height(0.0);
    let ends = (0..x.len()).filter(|v| x[*v].x > 0.199);
    let ends: Vec<usize> = ends.collect();
    let mut slept = 0;
    for frame in frames {
        let height = 0.015 * (f64::from(frame + 1) * 0.3).sin().powi(2);
        let pin = |v: &usize| PinTarget {
            vertex: *v as u32,
            target: x[*v] + V3d::new(-height, height, 0.0),
        };
        let pins: Vec<_> = ends.iter().map(pin).collect();
        let targets = pinned(&pins);
        slept += solver
            .advance(1.0 / 60.0, &targets)
            .expect("a frame")
            .asleep;
    }
    slept
}

#[test]
fn sleeping_cloth_is_behind_by_its_distance() {
    let (sheet, body, faces) = table();
    let cloth = sheet.cloth(isotropic(200.0, 0.3, 1e-6));
    let run = |sleep| {
        let settings = OfflineSettings {
            sleep,
            ..OfflineSettings::default()
        };
        let state = resting(&sheet.at_height(0.0), &body);
        let mut solver = OfflineSolver::new(&cloth, &faces, state, settings, Par::Seq)?;
        let slept = wave(&mut solver, 0..40);
        assert_free(&solver, [&sheet.faces, &faces]);
        Ok::<_, OfflineError>((solver.state().now.x.clone(), slept))
    };
    let (awake, none) = run(None).expect("a solver");
    assert_eq!(none, 0);
    for distance in [1e-3, 5e-4] {
        let settings = SleepSettings {
            distance,
            ..SleepSettings::default()
        };
        let (x, slept) = run(Some(settings)).expect("a solver");
        let apart = root_mean_square(&x, &awake);
        assert!(
            slept > 15 * awake.len() / 4,
            "{slept} vertices in 40 frames"
        );
        assert!(apart < distance, "{apart} m");
    }
}

#[test]
fn a_scene_at_rest_costs_nothing_and_wakes_with_its_table() {
    let (sheet, mut body, faces) = table();
    let cloth = sheet.cloth(isotropic(200.0, 0.3, 1e-6));
    let state = resting(&sheet.at_height(0.0), &body);
    let settings = OfflineSettings::default();
    let mut solver = OfflineSolver::new(&cloth, &faces, state, settings, Par::Seq).expect("solver");
    let frames = |solver: &mut OfflineSolver<'_>, body: &[V3d], count: usize| {
        let targets = FrameTargets {
            pins: &[],
            obstacle: body,
        };
        let one = |_| solver.advance(1.0 / 60.0, &targets).expect("a frame");
        (0..count).map(one).collect::<Vec<_>>()
    };
    let reports = frames(&mut solver, &body, 30);
    let last = reports.last().expect("frames");
    assert_eq!((last.steps, last.asleep), (0, cloth.len()), "{last:?}");
    let drape = DrapeSettings {
        most_steps: 1,
        final_steps: 0,
        ..DrapeSettings::default()
    };
    let draped = solver.drape(&drape, |_| ControlFlow::Continue(()));
    let work = draped.expect("a drape").newton;
    assert!(work.products > 0, "a drape looks at all cloth: {work:?}");
    body.iter_mut().for_each(|p| p.y += 5e-3);
    let woken = frames(&mut solver, &body, 1)[0];
    assert_eq!(woken.asleep, 0, "{woken:?}");
    let lowest = solver.state().now.x.iter().map(|p| p.y);
    assert!(lowest.fold(f64::INFINITY, f64::min) > 3e-3, "carried up");
    assert_free(&solver, [&sheet.faces, &faces]);
}

#[test]
fn a_resumed_sleep_has_the_same_bits() {
    let (sheet, body, faces) = table();
    let cloth = sheet.cloth(isotropic(200.0, 0.3, 1e-6));
    let new = || {
        let state = resting(&sheet.at_height(0.0), &body);
        OfflineSolver::new(&cloth, &faces, state, OfflineSettings::default(), Par::Seq)
    };
    let mut whole = new().expect("a solver");
    wave(&mut whole, 0..22);
    let bytes = whole.checkpoint(22);
    assert!(wave(&mut whole, 22..34) > 0);
    let mut rest = new().expect("a solver");
    assert_eq!(rest.resume(&bytes).expect("a checkpoint"), 22);
    wave(&mut rest, 22..34);
    assert!(whole.state() == rest.state());
    assert!(whole.checkpoint(34) == rest.checkpoint(34));
}
