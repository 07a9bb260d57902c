//! A scene from start to end by any solver.

use super::{Scene, SceneError};
use crate::live::integrators::{Environment, RunConfig, SheetStart, SolverReport, solver};
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;
use tryon_formats::FormatError;
use tryon_formats::npy::write_npy;
use tryon_geometry::math::order_statistics::{median, percentile};
use tryon_geometry::math::{P3, V3d};

/// Report of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RunReport {
    /// Frames of the output, the start included.
    pub frames: usize,
    /// Vertices.
    pub vertices: usize,
    /// Substeps a frame.
    pub substeps: usize,
    /// Iterations a substep.
    pub iterations: usize,
    /// Median computing time of a frame (ms).
    pub ms_median: f64,
    /// Mean computing time of a frame (ms).
    pub ms_mean: f64,
    /// Longest computing time of a frame (ms).
    pub ms_max: f64,
    /// 99th percentile of the edges' stretch at the end.
    pub p99_strain: f64,
    /// Largest depth of a vertex in a solid over all frames (m).
    pub penetration: f64,
    /// Kinetic plus elastic energy at the end (J).
    pub energy_end: f64,
    /// Numeric factorisations.
    pub factorisations: u64,
    /// Share of the membrane stiffness that is kept (explicit).
    pub softened: f64,
    /// Elements that keep less than 99 % of it (explicit).
    pub soft_elements: usize,
    /// Most vertices at once in contact with another fold (explicit with self-collision).
    pub fold_contacts: usize,
    /// Queries for other folds that were skipped, because none could have come near.
    pub fold_searches_skipped: usize,
}

/// Writes positions as f32, shape `[frames, vertices, 3]`.
///
/// # Errors
/// When the file cannot be written.
pub fn write_positions(path: &Path, frames: &[Vec<P3>]) -> Result<(), FormatError> {
    let n = frames.first().map_or(0, Vec::len);
    let flat: Vec<f32> = frames
        .iter()
        .flatten()
        .flat_map(|p| [p.x, p.y, p.z])
        .collect();
    write_npy(path, &[frames.len() as u64, n as u64, 3], flat.into_iter())
}

/// Simulates a scene. `frame` gets the positions of each frame once they are known, the start as frame 0, and may break off;
/// the report then covers the frames so far.
///
/// # Errors
/// A position that is not finite, by vertex.
pub fn run(
    scene: &Scene,
    config: &RunConfig,
    mut frame: impl FnMut(usize, &[P3]) -> ControlFlow<()>,
) -> Result<RunReport, SceneError> {
    let start = SheetStart {
        sheet: &scene.sheet,
        faces: &scene.faces,
        positions: &scene.start,
    };
    let pins = (&scene.pins[..], scene.pinned_to);
    let forces = (scene.gravity, config.offset);
    let environment = Environment::new(&scene.colliders, pins, &scene.start, forces);
    let mut solver = solver(start, &environment, config, scene.rate)?;
    let mut flow = frame(0, &scene.start);
    let mut times = Vec::new();
    let mut penetration: f64 = 0.0;
    for index in 1..scene.frames() {
        if flow.is_break() {
            break;
        }
        let started = Instant::now();
        let t = solver.advance(&environment, index)?;
        times.push(started.elapsed().as_secs_f64() * 1e3);
        let (x, _) = solver.state();
        penetration = environment.deepest(t, &x).max(penetration);
        let shown: Vec<P3> = x.iter().map(|p| P3::from(p.cast::<f32>())).collect();
        flow = frame(index, &shown);
    }
    let report = RunReport::new(scene, times, &solver.report(), &solver.state());
    Ok(RunReport {
        penetration,
        ..report
    })
}

impl RunReport {
    /// Report of a solver's counters, the times of its frames (ms) and its last positions (m) and velocities (m/s).
    fn new(
        scene: &Scene,
        mut times: Vec<f64>,
        solver: &SolverReport,
        (x, v): &(Vec<V3d>, Vec<V3d>),
    ) -> Self {
        let frames = times.len() + 1;
        let kinetic: f64 = v
            .iter()
            .zip(&scene.sheet.mass)
            .map(|(v, m)| 0.5 * m * v.norm_squared())
            .sum();
        Self {
            frames,
            vertices: x.len(),
            substeps: solver.substeps,
            iterations: solver.iterations,
            ms_median: median(&mut times).unwrap_or(0.0),
            ms_mean: times.iter().sum::<f64>() / times.len().max(1) as f64,
            ms_max: percentile(&mut times, 100).unwrap_or(0.0),
            p99_strain: scene.sheet.strain(x).1,
            penetration: 0.0,
            energy_end: kinetic + scene.sheet.energy(x),
            factorisations: solver.factorisations,
            softened: solver.softened,
            soft_elements: solver.soft_elements,
            fold_contacts: solver.fold_contacts,
            fold_searches_skipped: solver.fold_searches_skipped,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::integrators::Method;
    use crate::live::scene::parse;
    use tryon_geometry::spatial::intersections;

    /// A square sheet of 0.3 m, held at two corners, that falls and swings.
    fn swing() -> Scene {
        const CELLS: u32 = 6;
        let mut obj = String::new();
        for i in 0..=CELLS {
            for j in 0..=CELLS {
                obj += &format!("v {} 0 {}\n", 0.05 * f64::from(i), 0.05 * f64::from(j));
            }
        }
        for i in 0..CELLS {
            for j in 0..CELLS {
                let a = i * (CELLS + 1) + j + 1;
                obj += &format!(
                    "f {a} {} {}\nf {} {} {}\n",
                    a + 1,
                    a + CELLS + 1,
                    a + 1,
                    a + CELLS + 2,
                    a + CELLS + 1
                );
            }
        }
        let scene = serde_json::json!({
            "mesh_obj": obj, "pinned_vertices": [0, CELLS],
            "material": {
                "area_density_kg_m2": 0.2, "thickness_m": 5e-4, "young_membrane_N_m": 100.0, "poisson": 0.3,
                "bending_rigidity_N_m": 1e-3, "friction": 0.3,
            },
            "gravity": [0.0, -9.81, 0.0], "duration_s": 0.2, "output_fps": 60.0,
        });
        parse(&scene.to_string(), Path::new("swing"), None).expect("a scene")
    }

    fn end(config: &RunConfig) -> Vec<P3> {
        let mut last = Vec::new();
        run(&swing(), config, |_, x| {
            last = x.to_vec();
            ControlFlow::Continue(())
        })
        .expect("a run");
        last
    }

    /// BDF2 to convergence.
    fn converged(substeps: usize) -> Vec<P3> {
        end(&RunConfig {
            method: Method::QuasiNewtonBdf2,
            substeps,
            iterations: 120,
            ..RunConfig::default()
        })
    }

    fn apart(a: &[P3], b: &[P3]) -> f64 {
        let sum: f64 = a
            .iter()
            .zip(b)
            .map(|(a, b)| f64::from((a - b).norm_squared()))
            .sum();
        (sum / a.len() as f64).sqrt()
    }

    #[test]
    fn patches_give_the_same_bits_on_any_number_of_threads() {
        for patches in [1, 2, 3] {
            let c = RunConfig {
                patches,
                filter_degree: Some(2),
                ..RunConfig::default()
            };
            let on =
                |threads| tryon_geometry::par::with_threads(threads, || end(&c)).expect("threads");
            let one = on(1);
            assert!(one == on(2) && one == on(5), "{patches} patches");
            assert!(
                apart(&one, &end(&RunConfig { patches: 1, ..c })) < 1e-4,
                "{patches} patches and one"
            );
        }
    }

    /// A strip of 0.3 m that falls over a thin rod: its halves swing down and meet at about 3 m/s.
    fn strip_over_a_rod() -> Scene {
        const CELLS: [usize; 2] = [20, 6];
        let mut obj = String::new();
        for i in 0..=CELLS[0] {
            for j in 0..=CELLS[1] {
                let (x, z) = (
                    0.3 * i as f64 / CELLS[0] as f64 - 0.145,
                    0.09 * j as f64 / CELLS[1] as f64 - 0.045,
                );
                obj += &format!("v {x:.6} 0 {z:.6}\n");
            }
        }
        for i in 0..CELLS[0] {
            for j in 0..CELLS[1] {
                let a = i * (CELLS[1] + 1) + j + 1;
                let [b, c, d] = [a + 1, a + CELLS[1] + 1, a + CELLS[1] + 2];
                let two = if (i + j) % 2 == 1 {
                    [[a, b, c], [b, d, c]]
                } else {
                    [[a, b, d], [a, d, c]]
                };
                two.iter()
                    .for_each(|f| obj += &format!("f {} {} {}\n", f[0], f[1], f[2]));
            }
        }
        let turned = std::f64::consts::FRAC_1_SQRT_2;
        let scene = serde_json::json!({
            "mesh_obj": obj,
            "material": {
                "area_density_kg_m2": 0.2, "thickness_m": 5e-4, "young_membrane_N_m": 300.0, "poisson": 0.3,
                "bending_rigidity_N_m": 1e-4, "friction": 0.5,
            },
            "colliders": [{
                "type": "capsule", "radius": 0.01, "half_segment": 0.3, "friction": 0.5,
                "motion": [[0.0, 0.0, -0.012, 0.0, turned, 0.0, 0.0, turned]],
            }],
            "gravity": [0.0, -9.81, 0.0], "duration_s": 1.5, "output_fps": 60.0,
        });
        parse(&scene.to_string(), Path::new("strip"), None).expect("a scene")
    }

    #[test]
    fn self_collision_keeps_the_halves_of_a_strip_apart() {
        let scene = strip_over_a_rod();
        let most = |config: &RunConfig| {
            let mut most = 0;
            let report = run(&scene, config, |k, x| {
                if k % 5 == 0 {
                    most = intersections(&scene.faces, x).len().max(most);
                }
                ControlFlow::Continue(())
            });
            (most, report.expect("a run"))
        };
        let (off, _) = most(&RunConfig::default());
        let (on, report) = most(&RunConfig {
            self_collision: true,
            thickness: 0.005,
            ..RunConfig::default()
        });
        assert!(off > 20, "{off}: nothing would be tested");
        assert_eq!(on, 0, "{off} without");
        assert!(
            report.fold_contacts > 0 && report.fold_searches_skipped > 0,
            "{report:?}"
        );
        assert!(
            report.energy_end < 0.1,
            "no energy is gained: {}",
            report.energy_end
        );
    }

    #[test]
    fn bdf2_is_of_second_order() {
        let [coarse, middle, fine] = [16, 32, 64].map(converged);
        let ratio = apart(&coarse, &middle) / apart(&middle, &fine);
        assert!(
            ratio > 3.0,
            "halving the step divides the error by {ratio}, four in the limit"
        );
        assert!(
            apart(&coarse, &middle) < 1e-3,
            "{}",
            apart(&coarse, &middle)
        );
        // Another method on the same sheet comes to the same place.
        let explicit = end(&RunConfig {
            substeps: 400,
            ..RunConfig::default()
        });
        assert!(
            apart(&explicit, &fine) < 2e-3,
            "{}",
            apart(&explicit, &fine)
        );
    }

    #[test]
    fn comparison_solvers_swing_to_the_same_place() {
        let reference = converged(16);
        // Measured: 0.250 mm for XPBD, and 26.3 mm for springs, whose lattice is no continuum.
        for (method, bound) in [(Method::Xpbd, 2.9e-4), (Method::MassSpring, 0.03)] {
            let config = RunConfig {
                method,
                substeps: 200,
                ..RunConfig::default()
            };
            let distance = apart(&end(&config), &reference);
            assert!(distance < bound, "{method:?}: {distance} m");
        }
    }
}
