//! A scene from start to end by any of the solvers; the implicit ones, offline and baseline, are here.

use super::{Scene, SceneError};
use crate::cloth::ClothError;
use crate::cloth::solver::implicit::quasi_newton::{Hold, QuasiNewton, hold_unit};
use crate::formats::FormatError;
use crate::formats::npy::write_npy;
use crate::linear::SymbolicFactor;
use crate::math::{P3, V3d};
use nalgebra::{Isometry3, Point3};
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

/// How finely to compute.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunConfig {
    /// Which solver.
    pub method: Method,
    /// Implicit steps a frame of the output. Implicit Euler loses energy with the step: 1 step a frame halves a free
    /// swing within two seconds (docs/benchmarks.md).
    pub substeps: usize,
    /// Quasi-Newton iterations a step, at most.
    pub iterations: usize,
    /// Quasi-Newton: a step has converged when an iteration moves vertices less than this, metres (root mean square).
    pub tolerance: f64,
    /// Distance that cloth keeps from solids, metres: half a millimetre hides neither rounding nor a fabric's thickness.
    pub offset: f64,
    /// Small steps: how far ahead of positions forces are evaluated, in steps.
    pub ahead: f64,
    /// Small steps: steps from one evaluation of bending (0: as the smoothing allows) and from one search for contacts to
    /// the next.
    pub every: [usize; 2],
    /// Small steps: patches that may run on threads of their own.
    pub patches: usize,
    /// Small steps: degree of the smoothing of accelerations, 0 for none; else as the sheet needs.
    pub smooth: Option<usize>,
    /// Small steps: keep the folds of the sheet apart. Then nothing is smoothed unless `smooth` says so: folds that press
    /// on each other hard have torn smoothed sheets apart.
    pub self_collision: bool,
    /// Distance between two folds, metres; less where edges are short.
    pub thickness: f64,
    /// The most time between two searches for other folds, s; less where they move fast.
    pub fold_search: f64,
}

/// A solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Small explicit steps ([`crate::cloth::solver::explicit`]).
    SmallSteps,
    /// Prefactorised quasi-Newton, implicit Euler.
    QuasiNewton,
    /// The same with the second-order backward difference (BDF2).
    QuasiNewtonBdf2,
    /// XPBD with small steps: one pass over the triangles a step, on the same edges and bending as small steps.
    Xpbd,
    /// The paper's: springs along edges and across hinges, one linearised implicit Euler step.
    MassSpring,
}

impl Default for RunConfig {
    fn default() -> Self {
        Self {
            method: Method::SmallSteps,
            substeps: 0,
            iterations: 10,
            tolerance: 0.0,
            offset: 5e-4,
            ahead: 0.1,
            every: [0, 8],
            patches: 1,
            smooth: None,
            self_collision: false,
            thickness: 0.003,
            fold_search: 1.0 / 240.0,
        }
    }
}

impl RunConfig {
    /// The offline solver: finite elements in f64, second-order implicit steps of 1/960 s at 60 frames a second, each
    /// iterated until an iteration moves vertices by less than 0.01 µm. No contact of cloth with cloth.
    pub fn offline() -> Self {
        Self {
            method: Method::QuasiNewtonBdf2,
            substeps: OFFLINE_SUBSTEPS,
            iterations: OFFLINE_ITERATIONS,
            tolerance: OFFLINE_TOLERANCE,
            ..Self::default()
        }
    }
}

/// Steps a frame of the offline solver: 6.1 mm from the reference on the pinned square of 1k vertices, whose own
/// uncertainty is 8 mm; a test holds the second order that more steps would gain by.
const OFFLINE_SUBSTEPS: usize = 16;
/// Most iterations of one of its steps: free swinging takes 113 at most, contacts that come and go never end.
const OFFLINE_ITERATIONS: usize = 400;
/// Root mean square of the last iteration's steps, metres: far below what positions are written with (f32).
const OFFLINE_TOLERANCE: f64 = 1e-8;

/// Stiffness of pins and contacts in units of the matrix diagonal: pins are exact to a thousandth of a step's motion,
/// contacts leave sliding free (see the real-time solver).
const PIN_STIFFNESS: f64 = 1e3;
const CONTACT_STIFFNESS: f64 = 2.0;

/// Implicit steps a frame when none are asked for.
const USUAL_SUBSTEPS: usize = 8;

/// What a run says about itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RunReport {
    /// Frames of the output, the start included.
    pub frames: usize,
    /// Vertices.
    pub vertices: usize,
    /// Implicit steps a frame.
    pub substeps: usize,
    /// Iterations of the step that took the most.
    pub iterations: usize,
    /// Steps that were not converged at the last of their iterations, where convergence was asked for.
    pub unconverged: usize,
    /// Median, mean and longest computing time of a frame, milliseconds.
    pub ms_median: f64,
    /// Mean.
    pub ms_mean: f64,
    /// Longest.
    pub ms_max: f64,
    /// 99th percentile of the edges' stretch at the end.
    pub p99_strain: f64,
    /// Deepest vertex inside a solid over all frames, metres.
    pub penetration: f64,
    /// Kinetic plus elastic energy at the end, J.
    pub energy_end: f64,
    /// Numeric factorisations.
    pub factorisations: u64,
    /// Share of the membrane stiffness that the step could carry (small steps).
    pub softened: f64,
    /// Elements that keep less than 99 % of it (small steps).
    pub soft_elements: usize,
    /// Most vertices at once that were held off another fold (small steps with self-collision).
    pub fold_contacts: usize,
    /// Searches for other folds that were left out because none could have come near.
    pub fold_searches_skipped: usize,
}

/// Writes positions, frames × vertices, as f32 (frames, vertices, 3).
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

/// Simulates a scene. `frame` gets the positions of each frame as soon as they are known, the start as frame 0, and may
/// break off; the report then tells of the frames so far.
///
/// # Errors
/// When a position is no longer finite: names the vertex.
pub fn run(
    scene: &Scene,
    config: &RunConfig,
    frame: impl FnMut(usize, &[P3]) -> ControlFlow<()>,
) -> Result<RunReport, SceneError> {
    match config.method {
        Method::SmallSteps => super::small::run(scene, config, frame),
        Method::QuasiNewton => quasi_newton(scene, config, false, frame),
        Method::QuasiNewtonBdf2 => quasi_newton(scene, config, true, frame),
        Method::Xpbd | Method::MassSpring => super::baseline::run(scene, config, frame),
    }
}

fn quasi_newton(
    scene: &Scene,
    config: &RunConfig,
    second_order: bool,
    mut frame: impl FnMut(usize, &[P3]) -> ControlFlow<()>,
) -> Result<RunReport, SceneError> {
    let sheet = &scene.sheet;
    let n = scene.start.len();
    let substeps = if config.substeps == 0 {
        USUAL_SUBSTEPS
    } else {
        config.substeps
    };
    let h = 1.0 / (scene.rate * substeps as f64);
    let unit = hold_unit(sheet, h);
    let mut solver =
        QuasiNewton::new(SymbolicFactor::new(sheet.pattern.clone()).map_err(ClothError::from)?);
    let mut x: Vec<V3d> = scene.start.iter().map(|p| p.coords.cast()).collect();
    let mut v = vec![V3d::zeros(); n];
    // Positions and velocities one step earlier, for BDF2.
    let mut earlier: Option<(Vec<V3d>, Vec<V3d>)> = None;
    let local: Vec<V3d> = match scene.pinned_to {
        Some(c) => {
            let back = scene.colliders[c].placement(0.0).inverse();
            x.iter().map(|p| (back * Point3::from(*p)).coords).collect()
        }
        None => x.clone(),
    };
    let mut finished = 1;
    let mut flow = frame(0, &scene.start);
    let mut shown = Vec::with_capacity(n);
    let mut times = Vec::new();
    let (mut y, mut holds, mut stiffness) = (Vec::new(), Vec::new(), Vec::new());
    let mut penetration: f64 = 0.0;
    let (mut most, mut unconverged) = (0, 0);
    for index in 1..scene.frames() {
        if flow.is_break() {
            break;
        }
        let started = Instant::now();
        for s in 0..substeps {
            let t = ((index - 1) * substeps + s + 1) as f64 * h;
            let solids: Vec<(Isometry3<f64>, Isometry3<f64>)> = scene
                .colliders
                .iter()
                .map(|c| (c.placement(t - h), c.placement(t)))
                .collect();
            let before = x.clone();
            y.clear();
            // BDF2: 3x − 4x₋₁ + x₋₂ = 2h v, and the same for v: an implicit Euler step of 2h/3 from the extrapolation.
            let hb = if second_order && earlier.is_some() {
                h * 2.0 / 3.0
            } else {
                h
            };
            let (base, rate): (Vec<V3d>, Vec<V3d>) = match &earlier {
                Some((x0, v0)) if second_order => (
                    x.iter()
                        .zip(x0)
                        .map(|(x, x0)| (x * 4.0 - x0) / 3.0)
                        .collect(),
                    v.iter()
                        .zip(v0)
                        .map(|(v, v0)| (v * 4.0 - v0) / 3.0)
                        .collect(),
                ),
                _ => (x.clone(), v.clone()),
            };
            y.extend((0..n).map(|i| base[i] + rate[i] * hb + scene.gravity * (hb * hb)));
            x.copy_from_slice(&y);
            stiffness.clear();
            stiffness.resize(n, 0.0);
            for i in 0..n {
                if touches(scene, &solids, config.offset, &y[i]) {
                    stiffness[i] = CONTACT_STIFFNESS * unit[i];
                }
            }
            for &p in &scene.pins {
                stiffness[p as usize] = PIN_STIFFNESS * unit[p as usize];
            }
            solver.prepare(sheet, hb, &stiffness)?;
            let mut converged = config.tolerance <= 0.0;
            for iteration in 1..=config.iterations.max(1) {
                most = most.max(iteration);
                holds.clear();
                holds.extend((0..n).map(|i| {
                    let target = if stiffness[i] > 0.0 {
                        outside(scene, &solids, config.offset, &before[i], &y[i], x[i])
                    } else {
                        x[i]
                    };
                    Hold {
                        target,
                        stiffness: stiffness[i],
                    }
                }));
                for &p in &scene.pins {
                    holds[p as usize].target = pin(scene, &solids, &local[p as usize]);
                }
                if solver.iterate(sheet, &y, &holds, &mut x) < config.tolerance {
                    converged = true;
                    break;
                }
            }
            unconverged += usize::from(!converged);
            if let Some(index) = x.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
                return Err(ClothError::NotFinite {
                    what: "cloth vertex",
                    index,
                }
                .into());
            }
            for i in 0..n {
                x[i] = outside(scene, &solids, config.offset, &before[i], &y[i], x[i]);
            }
            for &p in &scene.pins {
                x[p as usize] = pin(scene, &solids, &local[p as usize]);
            }
            let old = v.clone();
            v.iter_mut()
                .zip(x.iter().zip(&base))
                .for_each(|(v, (x, b))| *v = (x - b) / hb);
            earlier = Some((before, old));
        }
        times.push(started.elapsed().as_secs_f64() * 1e3);
        penetration = deepest(scene, index as f64 / scene.rate, &x).max(penetration);
        shown.clear();
        shown.extend(x.iter().map(|p| P3::from(p.cast::<f32>())));
        flow = frame(index, &shown);
        finished += 1;
    }
    Ok(RunReport {
        frames: finished,
        substeps,
        iterations: most,
        unconverged,
        penetration,
        factorisations: solver.factorisations,
        ..RunReport::of(scene, times, &x, &v)
    })
}

impl RunReport {
    /// What every solver tells: times of the frames (ms) and the end.
    pub(super) fn of(scene: &Scene, mut times: Vec<f64>, x: &[V3d], v: &[V3d]) -> Self {
        times.sort_by(f64::total_cmp);
        let kinetic: f64 = v
            .iter()
            .zip(&scene.sheet.mass)
            .map(|(v, m)| 0.5 * m * v.norm_squared())
            .sum();
        Self {
            frames: scene.frames(),
            vertices: x.len(),
            ms_median: times.get(times.len() / 2).copied().unwrap_or(0.0),
            ms_mean: times.iter().sum::<f64>() / times.len().max(1) as f64,
            ms_max: times.last().copied().unwrap_or(0.0),
            p99_strain: scene.sheet.strain(x).1,
            energy_end: kinetic + scene.sheet.energy(x),
            ..Self::default()
        }
    }
}

/// Deepest vertex inside a solid at time `t`, metres.
pub(super) fn deepest(scene: &Scene, t: f64, x: &[V3d]) -> f64 {
    scene
        .colliders
        .iter()
        .flat_map(|c| {
            let back = c.placement(t).inverse();
            x.iter()
                .map(move |p| -c.shape.distance(&(back * Point3::from(*p)).coords).0)
        })
        .fold(0.0, f64::max)
}

fn pin(scene: &Scene, solids: &[(Isometry3<f64>, Isometry3<f64>)], local: &V3d) -> V3d {
    scene
        .pinned_to
        .map_or(*local, |c| (solids[c].1 * Point3::from(*local)).coords)
}

fn touches(
    scene: &Scene,
    solids: &[(Isometry3<f64>, Isometry3<f64>)],
    offset: f64,
    p: &V3d,
) -> bool {
    scene.colliders.iter().zip(solids).any(|(c, (_, at))| {
        c.shape
            .distance(&at.inverse_transform_point(&Point3::from(*p)).coords)
            .0
            < offset
    })
}

/// `x` pushed out of every solid, with Coulomb friction against the solid's own motion since `before`; how far inertia
/// alone (`y`) would sink stands for the normal force.
fn outside(
    scene: &Scene,
    solids: &[(Isometry3<f64>, Isometry3<f64>)],
    offset: f64,
    before: &V3d,
    y: &V3d,
    mut x: V3d,
) -> V3d {
    for (c, (was, at)) in scene.colliders.iter().zip(solids) {
        let (d, n) = c
            .shape
            .distance(&at.inverse_transform_point(&Point3::from(x)).coords);
        if d >= offset {
            continue;
        }
        let normal = at.rotation * n;
        x += normal * (offset - d);
        let load = (offset
            - c.shape
                .distance(&at.inverse_transform_point(&Point3::from(*y)).coords)
                .0)
            .max(0.0);
        let carried = (at * was.inverse() * Point3::from(*before)).coords;
        let slip = x - carried;
        let slip = slip - normal * slip.dot(&normal);
        let length = slip.norm();
        if length > 0.0 {
            x -= slip * (c.friction * load / length).min(1.0);
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::scene::parse;
    use crate::spatial::intersections;

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
        let report = run(&swing(), config, |_, x| {
            last = x.to_vec();
            ControlFlow::Continue(())
        })
        .expect("a run");
        assert_eq!(report.unconverged, 0);
        last
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
    fn patches_on_any_number_of_threads_give_the_same_bits() {
        for patches in [1, 2, 3] {
            let c = RunConfig {
                patches,
                smooth: Some(2),
                ..RunConfig::default()
            };
            let on = |threads| crate::par::with_threads(threads, || end(&c)).expect("threads");
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
    fn halves_of_a_strip_pass_through_each_other_only_without_self_collision() {
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
    fn the_offline_solver_is_of_second_order() {
        let with = |substeps| {
            end(&RunConfig {
                substeps,
                ..RunConfig::offline()
            })
        };
        let [coarse, middle, fine] = [16, 32, 64].map(with);
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
}
