//! Coulomb's law on an incline: a patch sticks below the angle of friction and slides with a = g (sin θ − μ cos θ) above.

use super::sheets::{GRAVITY, PlanarSheet, assert_free, converged, isotropic, resting};
use super::*;
use nalgebra::Rotation3;
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Patch on an inclined plane.
#[derive(Clone, Copy, Debug)]
struct Incline {
    /// Angle to the horizontal (rad).
    angle: f64,
    contact: ContactSettings,
    /// Length of a step (s).
    step: f64,
    /// Squares along a side of the patch of 60 mm.
    squares: u32,
    newton: NewtonSettings,
}

/// Length of a frame (s), and frames until the patch has settled on the barrier.
const FRAME: f64 = 1.0 / 60.0;
const SETTLING: usize = 6;

impl Incline {
    /// Velocity of the patch down the slope at the end of each frame (m/s).
    fn velocities(&self, frames: usize) -> Vec<f64> {
        let turn = Rotation3::from_axis_angle(&V3d::z_axis(), -self.angle);
        let down = turn * V3d::x();
        let patch = PlanarSheet::grid([self.squares; 2], [0.06 / f64::from(self.squares); 2]);
        let plane = PlanarSheet::grid([2, 2], [0.5, 0.2]);
        let tilt = |x: Vec<V3d>| -> Vec<V3d> { x.iter().map(|p| turn * p).collect() };
        let (x, obstacle) = (tilt(patch.at_height(9e-4)), tilt(plane.at_height(0.0)));
        let cloth = patch.cloth(isotropic(500.0, 0.3, 1e-5));
        let mut settings = OfflineSettings {
            longest_step: self.step,
            error_rate: f64::INFINITY,
            newton: self.newton,
            ..OfflineSettings::default()
        };
        settings.contact = Some(self.contact);
        let state = resting(&x, &obstacle);
        let mut solver =
            OfflineSolver::new(&cloth, &plane.faces, state, settings, Par::Seq).expect("solver");
        let mass: f64 = cloth.mass.iter().sum();
        let frame = |_| {
            let targets = FrameTargets::default();
            solver.advance(FRAME, &targets).expect("a frame");
            assert_free(&solver, [&patch.faces, &plane.faces]);
            let moving = solver.state().now.v.iter().zip(&cloth.mass);
            moving.map(|(v, m)| v.dot(&down) * m).sum::<f64>() / mass
        };
        (0..frames).map(frame).collect()
    }

    /// Mean acceleration down the slope after settling (m/s²), relative to the closed form.
    fn acceleration_error(&self) -> f64 {
        let v = self.velocities(18);
        let measured = (v[17] - v[SETTLING]) / (FRAME * (17 - SETTLING) as f64);
        let (s, c) = self.angle.sin_cos();
        measured / (GRAVITY * (s - self.contact.friction * c)) - 1.0
    }
}

fn incline(degrees: f64, friction: f64) -> Incline {
    Incline {
        angle: degrees.to_radians(),
        contact: ContactSettings {
            friction,
            ..ContactSettings::default()
        },
        step: 1.0 / 240.0,
        squares: 3,
        newton: converged(),
    }
}

#[test]
fn a_patch_slides_with_coulombs_acceleration() {
    for (degrees, friction) in [(20.0, 0.0), (20.0, 0.2), (40.0, 0.5)] {
        let error = incline(degrees, friction).acceleration_error();
        assert!(error.abs() < 0.005, "{degrees}° {friction}: {error}");
    }
}

/// A patch that sticks creeps slower than the speed from which friction is full.
#[test]
fn a_patch_sticks_below_the_angle_of_friction() {
    let creep = ContactSettings::default().creep;
    for (degrees, friction) in [(15.0, 0.3), (30.0, 0.7)] {
        let v = incline(degrees, friction).velocities(20);
        let fastest = v[SETTLING..].iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        assert!(fastest < creep, "{degrees}° {friction}: {fastest} m/s");
    }
}

/// However fast it may creep, and however long the step.
#[test]
fn a_patch_that_sticks_creeps_less_than_its_slip_in_a_step() {
    let mut patch = incline(15.0, 0.3);
    patch.contact.creep = 1.0;
    patch.step = FRAME;
    let v = patch.velocities(20);
    let fastest = v[SETTLING..].iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let slip = patch.contact.slip;
    assert!(fastest * FRAME < slip, "{fastest} m/s");
    patch.contact.slip = 1.0;
    assert!(patch.velocities(20)[19] * FRAME > 2.0 * slip);
}

#[test]
fn the_acceleration_depends_on_neither_step_nor_mesh() {
    let middle = incline(25.0, 0.3);
    for (step, squares) in [(1.0 / 60.0, 3), (1.0 / 960.0, 3), (1.0 / 240.0, 6)] {
        let other = Incline {
            step,
            squares,
            ..middle
        };
        let error = other.acceleration_error();
        assert!(error.abs() < 0.01, "{step} s, {squares} squares: {error}");
    }
}

/// A direction that is short because its linear system was solved to a tenth only says nothing of what is left to move.
#[test]
fn the_default_accuracy_lets_a_patch_slide() {
    for step in [1.0 / 60.0, 1.0 / 240.0] {
        let default = Incline {
            step,
            newton: NewtonSettings::default(),
            ..incline(20.0, 0.0)
        };
        let error = default.acceleration_error();
        assert!(error.abs() < 0.05, "{step} s: {error}");
    }
}
