//! Skips of the solver: queries by a margin, steps by an error estimate. Each can be switched off, and is bounded.

use super::test_sheets::{PlanarSheet, assert_free, converged, isotropic, octahedron, resting};
use super::*;
use crate::math::V3d;
use crate::par::Par;

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
        assert_free(&solver, &sheet.faces, &faces);
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
    let targets = FrameTargets {
        pins: &pins,
        obstacle: &[],
    };
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
