//! Static drape against a catenary, the balance of forces, a long motion, and another start.

use super::sheets::{
    GRAVITY, PlanarSheet, assert_free, converged, isotropic, octahedron, pinned, resting,
};
use super::*;
use crate::elastic::{ClothModel, ElasticExpansion, ElasticFabric};
use std::ops::ControlFlow;
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Square of 0.2 m whose corners are held 0.16 m apart.
struct Hammock {
    sheet: PlanarSheet,
    fabric: ElasticFabric,
    pins: Vec<PinTarget>,
}

impl Hammock {
    fn new(squares: u32) -> Self {
        let sheet = PlanarSheet::grid([squares; 2], [0.2 / f64::from(squares); 2]);
        let n = squares + 1;
        let flat = sheet.at_height(0.0);
        let pin = |vertex: u32| PinTarget {
            vertex,
            target: flat[vertex as usize] * 0.8,
        };
        Self {
            pins: [0, n - 1, n * (n - 1), n * n - 1].map(pin).to_vec(),
            fabric: isotropic(200.0, 0.3, 2e-4),
            sheet,
        }
    }

    /// Start between the corners: a paraboloid of this depth (m).
    fn start(&self, depth: f64) -> Vec<V3d> {
        let lower = |p: V3d| {
            let [u, v] = [p.x / 0.1, p.z / 0.1];
            V3d::new(0.8 * p.x, -depth * (1.0 - 0.5 * (u * u + v * v)), 0.8 * p.z)
        };
        self.sheet.at_height(0.0).into_iter().map(lower).collect()
    }

    fn targets(&self) -> FrameTargets<'_> {
        pinned(&self.pins)
    }
}

/// Drape without contact; Newton's method to `newton`, steps to a motion of `tolerance` (m).
fn drape(hammock: &Hammock, start: &[V3d], newton: NewtonSettings, tolerance: f64) -> Vec<V3d> {
    let cloth = hammock.sheet.cloth(hammock.fabric.clone());
    let settings = OfflineSettings {
        newton,
        contact: None,
        ..OfflineSettings::default()
    };
    let state = resting(start, &[]);
    let mut solver = OfflineSolver::new(&cloth, &[], state, settings, Par::Seq).expect("solver");
    let drape = DrapeSettings {
        tolerance,
        ..DrapeSettings::default()
    };
    let end = solver.drape_to(&drape, &hammock.targets(), |_| ControlFlow::Continue(()));
    let end = end.expect("a drape");
    assert!(end.settled, "{end:?}");
    solver.state().now.x.clone()
}

/// Root mean square of the force on a vertex that is free, over its weight.
fn imbalance(model: &ClothModel, x: &[V3d], is_held: impl Fn(usize) -> bool) -> f64 {
    let mut e = ElasticExpansion::default();
    model.expand(Par::Seq, x, &mut e);
    let (mut sum, mut count) = (0.0, 0.0);
    for (i, m) in model.masses().iter().enumerate() {
        if !is_held(i) {
            let force = e.gradient[i] + V3d::y() * (m * GRAVITY);
            sum += (force.norm() / (m * GRAVITY)).powi(2);
            count += 1.0;
        }
    }
    f64::sqrt(sum / count)
}

fn largest_distance(a: &[V3d], b: &[V3d]) -> f64 {
    let apart = a.iter().zip(b).map(|(a, b)| (a - b).norm());
    apart.fold(0.0, f64::max)
}

#[test]
fn forces_balance_at_rest() {
    let hammock = Hammock::new(10);
    let model = hammock.sheet.model(hammock.fabric.clone());
    let is_held = |i: usize| hammock.pins.iter().any(|p| p.vertex as usize == i);
    let residual = |newton| {
        let x = drape(&hammock, &hammock.start(0.06), newton, 5e-4);
        imbalance(&model, &x, is_held)
    };
    let residuals = [converged(), NewtonSettings::default()].map(residual);
    assert!(residuals[0] < 1e-3, "{residuals:?}");
}

/// A drape from which a finer mesh goes on ends where it settles, without the last steps to the solver's tolerance.
#[test]
fn a_drape_that_is_not_final_takes_fewer_iterations() {
    let hammock = Hammock::new(10);
    let cloth = hammock.sheet.cloth(hammock.fabric.clone());
    let work = |final_steps| {
        let settings = OfflineSettings {
            contact: None,
            ..OfflineSettings::default()
        };
        let state = resting(&hammock.start(0.06), &[]);
        let mut solver =
            OfflineSolver::new(&cloth, &[], state, settings, Par::Seq).expect("solver");
        let drape = DrapeSettings {
            final_steps,
            ..DrapeSettings::default()
        };
        let end = solver.drape_to(&drape, &hammock.targets(), |_| ControlFlow::Continue(()));
        end.expect("a drape")
    };
    let [coarse, last] = [0, 60].map(work);
    assert!(coarse.settled && last.settled, "{coarse:?} {last:?}");
    assert!(
        coarse.newton.products < last.newton.products,
        "{coarse:?} {last:?}"
    );
}

#[test]
fn two_starts_end_in_one_shape() {
    let hammock = Hammock::new(10);
    let ends = [0.03, 0.12].map(|d| drape(&hammock, &hammock.start(d), converged(), 1e-5));
    let apart = largest_distance(&ends[0], &ends[1]);
    assert!(apart < 5e-4, "{apart} m");
}

/// Implicit Euler damps the motion, so it ends in the drape's shape.
#[test]
fn a_long_motion_ends_in_the_drape() {
    let hammock = Hammock::new(8);
    let start = hammock.start(0.06);
    let still = drape(&hammock, &start, converged(), 1e-5);
    let cloth = hammock.sheet.cloth(hammock.fabric.clone());
    let settings = OfflineSettings {
        scheme: TimeScheme::ImplicitEuler,
        longest_step: 0.05,
        error_rate: f64::INFINITY,
        newton: converged(),
        contact: None,
        ..OfflineSettings::default()
    };
    let state = resting(&start, &[]);
    let mut solver = OfflineSolver::new(&cloth, &[], state, settings, Par::Seq).expect("solver");
    for _ in 0..200 {
        solver.advance(0.05, &hammock.targets()).expect("a frame");
    }
    let apart = largest_distance(&solver.state().now.x, &still);
    assert!(apart < 5e-4, "{apart} m");
}

/// Strip of length ℓ between two ends s apart: 2 a sinh(s/2a) = ℓ, sag a (cosh(s/2a) − 1). It stretches and bends a little.
#[test]
fn a_limp_strip_drapes_as_a_catenary() {
    const LENGTH: f64 = 0.3;
    let span = LENGTH / 1.3;
    let (mut low, mut high) = (0.05 * span, 5.0 * span);
    for _ in 0..60 {
        let a: f64 = 0.5 * (low + high);
        if 2.0 * a * (0.5 * span / a).sinh() > LENGTH {
            low = a;
        } else {
            high = a;
        }
    }
    let sag = low * ((0.5 * span / low).cosh() - 1.0);
    let error = |columns: u32| {
        let square = LENGTH / f64::from(columns);
        let sheet = PlanarSheet::grid([columns, 1], [square; 2]);
        let place = |p: V3d| {
            let u = p.x / LENGTH;
            V3d::new(span * u, sag * (4.0 * u * u - 1.0), p.z)
        };
        let start: Vec<V3d> = sheet.at_height(0.0).into_iter().map(place).collect();
        let ends = [0, columns, columns + 1, 2 * columns + 1];
        let pins: Vec<PinTarget> = ends
            .iter()
            .map(|v| PinTarget {
                vertex: *v,
                target: start[*v as usize],
            })
            .collect();
        let hammock = Hammock {
            sheet,
            fabric: isotropic(2000.0, 0.0, 1e-9),
            pins,
        };
        let x = drape(&hammock, &start, converged(), 1e-6);
        let deepest = x.iter().map(|p| p.y).fold(0.0, f64::min);
        -deepest / sag - 1.0
    };
    let errors = [8, 16, 32].map(error);
    assert!(errors[2].abs() < 3e-3, "{errors:?}");
    assert!(errors[2].abs() < errors[0].abs(), "{errors:?}");
}

/// With contact and friction: rest on a spike is rest of the motion too.
#[test]
fn cloth_settled_on_a_spike_stays() {
    let sheet = PlanarSheet::grid([8, 8], [0.02, 0.02]);
    let (body, faces) = octahedron(V3d::new(0.003, -0.0615, 0.002), 0.06);
    let cloth = sheet.cloth(isotropic(200.0, 0.3, 1e-5));
    let mut settings = OfflineSettings {
        newton: NewtonSettings {
            tolerance: 1e-6,
            linear_share: 1e-2,
            ..NewtonSettings::default()
        },
        ..OfflineSettings::default()
    };
    settings.contact = Some(ContactSettings {
        friction: 0.8,
        ..ContactSettings::default()
    });
    let state = resting(&sheet.at_height(0.0), &body);
    let mut solver = OfflineSolver::new(&cloth, &faces, state, settings, Par::Seq).expect("solver");
    let report = solver.drape(&DrapeSettings::default(), |_| ControlFlow::Continue(()));
    let report = report.expect("a drape");
    assert!(report.settled, "{report:?}");
    assert_free(&solver, [&sheet.faces, &faces]);
    let still = solver.state().now.x.clone();
    for _ in 0..15 {
        let targets = FrameTargets::default();
        solver.advance(1.0 / 60.0, &targets).expect("a frame");
    }
    assert_free(&solver, [&sheet.faces, &faces]);
    let apart = largest_distance(&solver.state().now.x, &still);
    assert!(apart < 5e-3, "{apart} m");
}
