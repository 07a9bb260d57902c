//! Strip between two clamps that turn against each other: a helicoid's energy at first, free of intersections to the end.

use super::sheets::{PlanarSheet, assert_free, converged, isotropic, pinned, resting};
use super::*;
use crate::elastic::ClothModel;
use nalgebra::Rotation3;
use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Length and width (m); the clamps hold the outer column of vertices at each end and the one beside it.
const LENGTH: f64 = 0.2;
const WIDTH: f64 = 0.02;
const YOUNG: f64 = 500.0;
const RIGIDITY: f64 = 1e-5;

/// Strip of `columns` squares along x.
struct TwistedStrip {
    sheet: PlanarSheet,
    model: ClothModel,
    columns: u32,
}

impl TwistedStrip {
    fn new(columns: u32) -> Self {
        let rows = (f64::from(columns) * WIDTH / LENGTH).round() as u32;
        let sides = [LENGTH / f64::from(columns), WIDTH / f64::from(rows)];
        let sheet = PlanarSheet::grid([columns, rows], sides);
        Self {
            model: sheet.model(isotropic(YOUNG, 0.0, RIGIDITY)),
            sheet,
            columns,
        }
    }

    /// Helicoid in which the right end has turned by `angle` (rad) against the left one; ends `nearer` (m).
    fn helicoid(&self, angle: f64, nearer: f64) -> Vec<V3d> {
        let flat = self.sheet.at_height(0.0);
        let place = |p: &V3d| {
            let turn = Rotation3::from_axis_angle(&V3d::x_axis(), angle * p.x / LENGTH);
            turn * V3d::new(p.x * (1.0 - nearer / LENGTH), 0.0, p.z)
        };
        flat.iter().map(place).collect()
    }

    /// Clamps as they hold the helicoid.
    fn clamps(&self, helicoid: &[V3d]) -> Vec<PinTarget> {
        let is_held = |v: &usize| {
            let column = *v as u32 % (self.columns + 1);
            column < 2 || column + 2 > self.columns
        };
        let held = (0..helicoid.len()).filter(is_held);
        held.map(|v| PinTarget {
            vertex: v as u32,
            target: helicoid[v],
        })
        .collect()
    }

    fn energy(&self, x: &[V3d]) -> f64 {
        self.model.energy(Par::Seq, x)
    }
}

/// Energy of a helicoid of twist τ (1/m) whose axis keeps its length: E₁₁ = τ² z²/2, κ₁₂ = τ.
fn closed_form(twist: f64) -> f64 {
    let membrane = 0.5 * YOUNG * 0.25 * twist.powi(4) * WIDTH.powi(5) / 80.0;
    (membrane + RIGIDITY * twist.powi(2) * WIDTH) * LENGTH
}

/// Green 1937: up to a critical twist a strip stays a helicoid. Its transverse stress, left out here, is (τ w)²/8 of the
/// longitudinal one.
#[test]
fn energy_of_a_quarter_turn_converges_to_the_helicoids() {
    let angle = 0.5 * PI;
    let error = |columns| {
        let strip = TwistedStrip::new(columns);
        let cloth = strip
            .sheet
            .cloth_in(isotropic(YOUNG, 0.0, RIGIDITY), V3d::zeros());
        let settings = OfflineSettings {
            newton: converged(),
            contact: None,
            ..OfflineSettings::default()
        };
        let start = strip.helicoid(angle, 0.0);
        let pins = strip.clamps(&start);
        let state = resting(&start, &[]);
        let mut solver =
            OfflineSolver::new(&cloth, &[], state, settings, Par::Seq).expect("solver");
        let targets = pinned(&pins);
        let drape = DrapeSettings {
            tolerance: 1e-6,
            ..DrapeSettings::default()
        };
        let report = solver.drape_to(&drape, &targets, |_| ControlFlow::Continue(()));
        assert!(report.expect("a drape").settled);
        strip.energy(&solver.state().now.x) / closed_form(angle / LENGTH) - 1.0
    };
    let errors = [20, 40, 80].map(error);
    let [coarse, fine] = [errors[0] - errors[1], errors[1] - errors[2]];
    let order = (coarse / fine).log2();
    assert!((order - 2.0).abs() < 0.2, "order {order}: {errors:?}");
    let limit = errors[2] - fine / 3.0;
    assert!(limit.abs() < 0.01, "{errors:?}");
}

/// Turns the right end by `turns` while the ends near each other, and asserts that no frame ends with an intersection.
/// Returns the elastic energy at rest over that of the helicoid between the same clamps.
fn wring(turns: f64, nearer: f64) -> f64 {
    const TURN_OF_A_FRAME: f64 = 0.1 * PI;
    let strip = TwistedStrip::new(40);
    let cloth = strip
        .sheet
        .cloth_in(isotropic(YOUNG, 0.0, RIGIDITY), V3d::zeros());
    let state = resting(&strip.helicoid(0.0, 0.0), &[]);
    let settings = OfflineSettings {
        error_rate: f64::INFINITY,
        ..OfflineSettings::default()
    };
    let mut solver = OfflineSolver::new(&cloth, &[], state, settings, Par::Seq).expect("solver");
    let frames = (turns * TAU / TURN_OF_A_FRAME).ceil() as usize;
    let mut pins = Vec::new();
    for frame in 1..=frames {
        let share = frame as f64 / frames as f64;
        pins = strip.clamps(&strip.helicoid(turns * TAU * share, nearer * share));
        let targets = pinned(&pins);
        solver.advance(1.0 / 30.0, &targets).expect("a frame");
        assert_free(&solver, [&strip.sheet.faces, &[]]);
        assert!(strip.energy(&solver.state().now.x).is_finite());
    }
    let targets = pinned(&pins);
    let drape = DrapeSettings {
        most_steps: 20,
        ..DrapeSettings::default()
    };
    let report = solver.drape_to(&drape, &targets, |_| ControlFlow::Continue(()));
    report.expect("a drape");
    assert_free(&solver, [&strip.sheet.faces, &[]]);
    let helicoid = strip.helicoid(turns * TAU, nearer);
    strip.energy(&solver.state().now.x) / strip.energy(&helicoid)
}

/// A helicoid is between the same clamps, so rest has no more energy than it.
#[test]
fn a_strip_turned_twice_has_no_intersection() {
    for (turns, nearer) in [(2.0, 0.0), (2.0, 0.06)] {
        let share = wring(turns, nearer);
        assert!(share < 1.0, "{turns} turns: {share}");
    }
}
