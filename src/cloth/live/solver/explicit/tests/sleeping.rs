//! Sleeping vertices against held ones.

use crate::live::solver::explicit::test_sheets::{cotton, grid, hold, sheet, stable_step};
use crate::live::solver::explicit::{
    PatchModel, PatchState, StableSheet, StepSpec, Substep, V4, VertexPlanes,
};
use crate::settings::SolverSettings;
use tryon_geometry::math::V3d;

const STEPS: usize = 300;

/// State of a patch that falls for [`STEPS`] substeps, its first vertices asleep or held.
fn fall(f: &PatchModel, x: &[V3d], h: f32, first: usize, sleeps: bool) -> PatchState {
    let mut m = PatchState::default();
    let start = f.vertices.iter().map(|v| x[*v as usize].into());
    m.reset(start, f.vertices.iter().map(|_| V4::default()));
    let pins = if sleeps {
        let asleep: Vec<bool> = (0..x.len()).map(|i| i < first).collect();
        m.set_sleeping(f, &asleep);
        Vec::new()
    } else {
        hold(f, &m, &f.vertices[..first])
    };
    let step = Substep {
        h,
        lookahead: 0.25,
        gravity: V4::new(0.0, -9.81, 0.0),
        rings: usize::MAX,
        ..Substep::default()
    };
    for i in 0..STEPS {
        if i % 3 == 0 {
            m.update_bending(f, 1.5 * h, usize::MAX);
        }
        m.integrate_velocities(f, &step, &VertexPlanes::default(), &pins);
        m.apply_pins(&pins, 0.0, h);
        m.integrate_positions(f, &step, f32::INFINITY);
    }
    m
}

#[test]
fn cloth_beside_sleeping_cloth_moves_as_beside_held_cloth() {
    let (x, faces, rest) = grid(24, 16, 0.02, 0.02);
    for filter_degree in 0..3 {
        let s = sheet(&faces, &rest, x.len(), &cotton(1e-5));
        let h = stable_step(&s, filter_degree);
        let spec = StepSpec {
            h,
            lookahead: 0.25,
            bending_interval: 3,
            filter_degree,
        };
        let f =
            &StableSheet::new(&s, &spec, &SolverSettings::default()).compile_patches(1, 0, 64)[0];
        let half = f.islands[f.islands.len() / 2];
        let [sleeping, held] = [true, false].map(|sleeps| fall(f, &x, h as f32, half, sleeps));
        let n = x.len();
        let fallen = held
            .displacement
            .iter()
            .map(|d| -d.0[1])
            .fold(0.0, f32::max);
        assert!(fallen > 1e-3, "{fallen}");
        assert!(
            sleeping.displacement[..half]
                .iter()
                .all(|d| *d == V4::default())
        );
        let components =
            (half..n).flat_map(|i| (sleeping.displacement[i] - held.displacement[i]).0);
        let apart = components.fold(0.0, |a: f32, c| a.max(c.abs()));
        assert!(
            apart < 1e-4 * fallen,
            "degree {filter_degree}: {apart} m apart, fallen by {fallen}"
        );
        let active = sleeping.scratch.active.as_ref().expect("half sleeps");
        let computed: usize = active.quads.iter().map(|r| r.len()).sum();
        assert!(
            computed * 10 < f.quads.len() * 8,
            "{computed} of {} blocks for half of the cloth",
            f.quads.len()
        );
    }
}
