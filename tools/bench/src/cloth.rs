//! Cloth solvers side by side on the standard scenes, against reference positions where there are some.

use super::{EvaluateError, Row, Table};
use std::ops::ControlFlow;
use std::path::Path;
use tryon_cloth::scene::{Method, RunConfig, RunReport, Scene, SceneError, load, run};
use tryon_formats::npy::read_npy;
use tryon_geometry::math::P3;

/// Scenes and extent of the comparison of solvers.
#[derive(Clone, Debug, PartialEq)]
pub struct ClothBench {
    /// Scene names: files of the scenes folder without extension.
    pub scenes: Vec<String>,
    /// All methods on the large scenes too (minutes).
    pub full: bool,
}

impl Default for ClothBench {
    fn default() -> Self {
        let scenes = [
            "A_pin_1k",
            "A_pin_5k",
            "B_sphere_1k",
            "C_skirt_1k",
            "C_skirt_5k",
            "C_skirt_10k",
        ];
        Self {
            scenes: scenes.map(str::to_owned).to_vec(),
            full: false,
        }
    }
}

/// A method and its settings: steps a frame (0: as many as the fabric needs), iterations, patches.
const SETTINGS: [(Method, usize, usize, usize); 17] = [
    (Method::Explicit, 0, 1, 1),
    (Method::Explicit, 0, 1, 2),
    (Method::Explicit, 50, 1, 1),
    (Method::Explicit, 80, 1, 1),
    (Method::Explicit, 128, 1, 2),
    (Method::Explicit, 160, 1, 1),
    (Method::Xpbd, 20, 1, 1),
    (Method::Xpbd, 40, 1, 1),
    (Method::Xpbd, 80, 1, 1),
    (Method::QuasiNewton, 2, 10, 1),
    (Method::QuasiNewton, 8, 10, 1),
    (Method::QuasiNewtonBdf2, 2, 10, 1),
    (Method::QuasiNewtonBdf2, 4, 10, 1),
    (Method::QuasiNewtonBdf2, 8, 10, 1),
    (Method::MassSpring, 2, 1, 1),
    (Method::MassSpring, 4, 1, 1),
    (Method::MassSpring, 8, 1, 1),
];
/// Scenes with more vertices than this are left to the fast methods unless asked for.
const LARGE: usize = 2000;

/// Name of a method in tables.
pub fn method_name(m: Method) -> &'static str {
    match m {
        Method::Explicit => "small steps",
        Method::QuasiNewton => "quasi-Newton, implicit Euler",
        Method::QuasiNewtonBdf2 => "quasi-Newton, BDF2",
        Method::Xpbd => "XPBD",
        Method::MassSpring => "mass-spring (paper)",
    }
}

/// Runs every method on every scene of `folder`; `progress` receives each row.
///
/// # Errors
/// A scene that cannot be read. A method that diverges is a row with error `diverged` 1.
pub fn cloth(
    folder: &Path,
    bench: &ClothBench,
    mut progress: impl FnMut(&Row),
) -> Result<Table, EvaluateError> {
    let mut table = Table {
        name: "cloth".into(),
        command: "evaluate::cloth::cloth".into(),
        run_time: "milliseconds for 1/60 s of cloth, median over the scene".into(),
        rows: Vec::new(),
    };
    for name in &bench.scenes {
        let fault = |e: SceneError| EvaluateError::Scene {
            scene: name.clone(),
            why: e.to_string(),
        };
        let scene = load(&folder.join(format!("{name}.json"))).map_err(fault)?;
        let reference = reference(folder, name, &scene);
        for (method, substeps, iterations, patches) in SETTINGS {
            if scene.start.len() > LARGE && method != Method::Explicit && !bench.full {
                continue;
            }
            let config = RunConfig {
                method,
                substeps,
                iterations,
                patches,
                ..RunConfig::default()
            };
            let mut frames = Vec::new();
            let result = run(&scene, &config, |_, p| {
                frames.push(p.to_vec());
                ControlFlow::Continue(())
            });
            let row = match result {
                Ok(report) => measured(name, &config, &report, &frames, reference.as_deref()),
                Err(_) => Row::new(name.clone(), method_name(method), f64::NAN)
                    .with("steps", substeps)
                    .with("iterations", iterations)
                    .with("patches", patches)
                    .error("diverged", 1.0),
            };
            progress(&row);
            table.rows.push(row);
        }
    }
    Ok(table)
}

fn measured(
    name: &str,
    config: &RunConfig,
    r: &RunReport,
    frames: &[Vec<P3>],
    reference: Option<&[Vec<P3>]>,
) -> Row {
    let mut row = Row::new(name, method_name(config.method), r.ms_median)
        .with("steps", r.substeps)
        .with("iterations", r.iterations)
        .with("patches", config.patches)
        .error("strain_p99_percent", r.p99_strain * 100.0)
        .error("penetration_mm", r.penetration * 1e3);
    if config.method == Method::Explicit {
        row = row.with("stiffness_kept", format!("{:.2}", r.softened));
    }
    match reference {
        Some(reference) => reference_errors(row, frames, reference),
        None => row,
    }
}

/// Adds the distances from reference positions, shape `[frames][vertices]`: the centre of mass over all frames, the vertices at
/// half a second.
pub(super) fn reference_errors(row: Row, frames: &[Vec<P3>], reference: &[Vec<P3>]) -> Row {
    /// Half a second at 60 frames a second: later the swing is chaotic.
    const HALF: usize = 30;
    let n = reference.len().min(frames.len());
    let sum: f64 = (0..n)
        .map(|k| (centre(&frames[k]) - centre(&reference[k])).norm_squared())
        .sum();
    let row = row.error("com_rms_mm", (sum / n.max(1) as f64).sqrt() * 1e3);
    if n <= HALF {
        return row;
    }
    let apart = frames[HALF]
        .iter()
        .zip(&reference[HALF])
        .map(|(a, b)| f64::from((a - b).norm_squared()));
    let rms = (apart.sum::<f64>() / frames[HALF].len().max(1) as f64).sqrt();
    row.error("vertices_rms_mm", rms * 1e3)
}

fn centre(p: &[P3]) -> nalgebra::Vector3<f64> {
    p.iter()
        .map(|p| p.coords.cast::<f64>())
        .sum::<nalgebra::Vector3<f64>>()
        / p.len().max(1) as f64
}

/// Reference positions of a scene, shape `[frames][vertices]`, if there are any of its size.
pub(super) fn reference(folder: &Path, name: &str, scene: &Scene) -> Option<Vec<Vec<P3>>> {
    let (shape, values) = read_npy(&folder.join(format!("{name}.reference.npy"))).ok()?;
    if shape.len() != 3 || shape[1] as usize != scene.start.len() || shape[2] != 3 {
        return None;
    }
    Some(
        values
            .chunks_exact(3 * scene.start.len())
            .map(|f| {
                f.chunks_exact(3)
                    .map(|p| P3::new(p[0], p[1], p[2]))
                    .collect()
            })
            .collect(),
    )
}
