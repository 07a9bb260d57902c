//! Scenes that break contact solvers: slivers, pressed folds, piles, tangled starts, extreme strain, speed.

use super::sheets::{PlanarSheet, assert_free, isotropic, octahedron, resting};
use super::*;
use crate::contact::{ContactMesh, ContactSurface};
use nalgebra::Vector2;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;

pub(super) const FRAME: f64 = 1.0 / 60.0;

/// Steps of the longest length: speed is wanted, not accuracy in time.
pub(super) fn coarse() -> OfflineSettings {
    OfflineSettings {
        error_rate: f64::INFINITY,
        ..OfflineSettings::default()
    }
}

/// Frames that must all end without an intersection and with finite positions; `faces` of cloth and obstacle.
pub(super) fn run(
    solver: &mut OfflineSolver<'_>,
    faces: [&[Face]; 2],
    frames: usize,
    mut targets: impl FnMut(usize) -> (Vec<PinTarget>, Vec<V3d>),
) {
    for frame in 1..=frames {
        let (pins, target) = targets(frame);
        let targets = FrameTargets {
            pins: &pins,
            obstacle: &target,
        };
        let report = solver.advance(FRAME, &targets);
        assert!(report.is_ok(), "frame {frame}: {report:?}");
        let x = &solver.state().now.x;
        assert!(x.iter().all(|p| p.iter().all(|c| c.is_finite())));
        assert_free(solver, faces);
    }
}

/// No targets.
pub(super) fn still(_: usize) -> (Vec<PinTarget>, Vec<V3d>) {
    (Vec::new(), Vec::new())
}

/// Sheet whose middle column is `width` (m) wide, the others 20 mm.
fn sheet_with_slivers(width: f64) -> PlanarSheet {
    let mut sheet = PlanarSheet::grid([7, 6], [0.02, 0.02]);
    let narrow = 0.02 - width;
    for p in &mut sheet.at {
        let side = if p.x > 0.0 { -0.5 } else { 0.5 };
        *p += Vector2::new(side * narrow, 0.0);
    }
    sheet
}

/// Triangles of aspect 10⁴, 2 µm high, on a spike.
#[test]
fn slivers_fall_on_a_spike() {
    for width in [2e-3, 2e-6] {
        let sheet = sheet_with_slivers(width);
        let (body, faces) = octahedron(V3d::new(0.003, -0.065, 0.002), 0.06);
        let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
        let state = resting(&sheet.at_height(0.0), &body);
        let mut solver =
            OfflineSolver::new(&cloth, &faces, state, coarse(), Par::Seq).expect("solver");
        run(&mut solver, [&sheet.faces, &faces], 10, still);
    }
}

/// Strip of three layers 6 mm apart, joined by half circles; rest is flat.
fn zigzag(columns: u32) -> (PlanarSheet, Vec<V3d>) {
    const RADIUS: f64 = 3e-3;
    const STRAIGHT: f64 = 0.04;
    let bend = std::f64::consts::PI * RADIUS;
    let length = 3.0 * STRAIGHT + 2.0 * bend;
    let side = length / f64::from(columns);
    let sheet = PlanarSheet::grid([columns, 3], [side, side]);
    let place = |p: &Vector2<f64>| {
        let s = p.x + 0.5 * length;
        let period = STRAIGHT + bend;
        let layer = (s / period).floor().min(2.0);
        let [along, over] = [s - layer * period, s - layer * period - STRAIGHT];
        let base = 2.0 * RADIUS * layer;
        let [x, y] = if over <= 0.0 {
            [along, base]
        } else {
            let (sin, cos) = (over / RADIUS).sin_cos();
            [STRAIGHT + RADIUS * sin, base + RADIUS * (1.0 - cos)]
        };
        let x = if layer == 1.0 { STRAIGHT - x } else { x };
        V3d::new(x, y, -p.y)
    };
    let folded = sheet.at.iter().map(place).collect();
    (sheet, folded)
}

/// Plates above and below, from a gap that holds the folds to one of `gap` (m).
fn press(gap: f64) {
    let (sheet, folded) = zigzag(48);
    let mut plates = PlanarSheet::grid([2, 2], [0.1, 0.1]);
    plates.append(&plates.clone());
    let place = |lower: f64, upper: f64| -> Vec<V3d> {
        let mut x = plates.at_height(lower);
        x[9..].iter_mut().for_each(|p| p.y = upper);
        x
    };
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let state = resting(&folded, &place(-2e-3, 14e-3));
    let mut solver =
        OfflineSolver::new(&cloth, &plates.faces, state, coarse(), Par::Seq).expect("solver");
    let frames = 12;
    run(
        &mut solver,
        [&sheet.faces, &plates.faces],
        frames,
        |frame| {
            let height = 16e-3 + (gap - 16e-3) * frame as f64 / frames as f64;
            (Vec::new(), place(-2e-3, height - 2e-3))
        },
    );
    let x = solver.state().now.x.iter();
    let [low, high] = x.fold([f64::INFINITY, f64::NEG_INFINITY], |r, p| {
        [r[0].min(p.y), r[1].max(p.y)]
    });
    assert!(high - low < gap.max(2e-3), "thickness {} m", high - low);
}

#[test]
fn folds_are_pressed_flat_between_plates() {
    for gap in [4e-3, 1e-3] {
        press(gap);
    }
}

/// Small patches a little turned against each other, 2 mm apart, above a plane.
fn drop_pile(layers: u32) {
    let patch = PlanarSheet::grid([2, 2], [0.01, 0.01]);
    let plane = PlanarSheet::grid([1, 1], [0.1, 0.1]);
    let (mut pile, mut x) = (PlanarSheet::default(), Vec::new());
    for layer in 0..layers {
        pile.append(&patch);
        let turn = nalgebra::Rotation3::from_axis_angle(&V3d::y_axis(), 0.7 * f64::from(layer));
        let at = patch.at_height(2e-3 * f64::from(layer + 1));
        x.extend(at.iter().map(|p| turn * p));
    }
    let cloth = pile.cloth(isotropic(500.0, 0.3, 1e-5));
    let state = resting(&x, &plane.at_height(0.0));
    let mut solver =
        OfflineSolver::new(&cloth, &plane.faces, state, coarse(), Par::Seq).expect("solver");
    run(&mut solver, [&pile.faces, &plane.faces], 6, still);
    let order = |layer: usize| solver.state().now.x[9 * layer + 4].y;
    assert!((1..layers as usize).all(|l| order(l) > order(l - 1)));
}

#[test]
fn a_pile_of_a_hundred_layers_falls_on_a_plane() {
    drop_pile(100);
}

/// A vertex that begins 4 mm inside the obstacle is freed; the obstacle grows back and the cloth stays outside.
#[test]
fn a_repaired_start_stays_free() {
    let sheet = PlanarSheet::grid([6, 6], [0.02, 0.02]);
    let plate = PlanarSheet::grid([3, 3], [0.1, 0.1]);
    let mut x = sheet.at_height(2e-3);
    x[24].y = -4e-3;
    let target = plate.at_height(0.0);
    fn surface(sheet: &PlanarSheet) -> ContactSurface<'_> {
        ContactSurface {
            vertices: sheet.at.len(),
            faces: &sheet.faces,
        }
    }
    let mesh = ContactMesh::new(surface(&sheet), surface(&plate)).expect("a mesh");
    let n = x.len();
    x.extend(&target);
    let report = JoinedSurfaces(&mesh).repair(Par::Seq, &mut x);
    assert!(report.expect("a repair").found > 0);
    let mut state = resting(&x[..n], &target);
    state.obstacle[0] = x[n..].to_vec();
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let mut solver =
        OfflineSolver::new(&cloth, &plate.faces, state, coarse(), Par::Seq).expect("solver");
    assert_free(&solver, [&sheet.faces, &plate.faces]);
    run(&mut solver, [&sheet.faces, &plate.faces], 10, still);
    let give = solver.state().obstacle[0].iter().zip(&target);
    let give = give.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(give < 1e-4, "the obstacle is {give} m from its target");
    assert!(solver.state().now.x.iter().all(|p| p.y > 0.0));
}

/// Ends pulled to ten times the length, or pushed to a tenth of it, in ten frames.
fn pull(stretch: f64) {
    let sheet = PlanarSheet::grid([10, 4], [0.01, 0.01]);
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let flat = sheet.at_height(0.0);
    let state = resting(&flat, &[]);
    let mut solver = OfflineSolver::new(&cloth, &[], state, coarse(), Par::Seq).expect("solver");
    let frames = 10;
    run(&mut solver, [&sheet.faces, &[]], frames, |frame| {
        let factor = 1.0 + (stretch - 1.0) * frame as f64 / frames as f64;
        let ends = (0..flat.len()).filter(|v| matches!(v % 11, 0 | 10));
        let pin = |v: usize| PinTarget {
            vertex: v as u32,
            target: V3d::new(flat[v].x * factor, 0.0, flat[v].z),
        };
        (ends.map(pin).collect(), Vec::new())
    });
    // Let go.
    run(&mut solver, [&sheet.faces, &[]], 5, still);
    let x = &solver.state().now.x;
    let extent = (x[10] - x[0]).norm();
    assert!(extent < 0.25, "it springs back: {extent} m");
}

#[test]
fn ends_are_pulled_to_ten_times_the_length_and_pushed_to_a_tenth() {
    for stretch in [10.0, 0.1] {
        pull(stretch);
    }
}

/// The whole sheet begins at ten times its size, above a spike.
#[test]
fn a_start_of_ten_times_the_size_is_solved() {
    let sheet = PlanarSheet::grid([8, 8], [0.005, 0.005]);
    let x: Vec<V3d> = sheet.at_height(0.0).iter().map(|p| p * 10.0).collect();
    let (body, faces) = octahedron(V3d::new(0.003, -0.065, 0.002), 0.06);
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let state = resting(&x, &body);
    let mut solver = OfflineSolver::new(&cloth, &faces, state, coarse(), Par::Seq).expect("solver");
    run(&mut solver, [&sheet.faces, &faces], 8, still);
    let x = &solver.state().now.x;
    let extent = (x[8] - x[0]).norm();
    assert!(extent < 0.08, "{extent} m across");
}

/// A body passes through a sheet's place at 10 m/s for three frames.
#[test]
fn a_body_of_ten_metres_a_second_takes_a_hanging_sheet_along() {
    let sheet = PlanarSheet::grid([8, 8], [0.02, 0.02]);
    let x: Vec<V3d> = (sheet.at.iter()).map(|p| V3d::new(p.x, p.y, 0.0)).collect();
    let (body, faces) = octahedron(V3d::new(0.004, -0.003, -0.08), 0.06);
    let cloth = sheet.cloth(isotropic(500.0, 0.3, 1e-5));
    let state = resting(&x, &body);
    let mut solver = OfflineSolver::new(&cloth, &faces, state, coarse(), Par::Seq).expect("solver");
    let pins = [72, 80].map(|v| PinTarget {
        vertex: v,
        target: x[v as usize],
    });
    run(&mut solver, [&sheet.faces, &faces], 3, |frame| {
        let on = V3d::new(0.0, 0.0, 10.0 * FRAME * frame as f64);
        (pins.to_vec(), body.iter().map(|p| p + on).collect())
    });
}
