//! The live step on the standard scenes, against reference positions where there are some.

use super::{EvaluateError, Row, Table};
use std::ops::ControlFlow;
use std::path::Path;
use tryon_cloth::Config;
use tryon_cloth::scene::{RunReport, Scene, SceneError, load, run};
use tryon_formats::npy::read_npy;
use tryon_geometry::math::P3;
use tryon_geometry::par::Par;

/// Scenes measured: files of the scenes folder without extension.
pub const SCENES: [&str; 6] = [
    "A_pin_1k",
    "A_pin_5k",
    "B_sphere_1k",
    "C_skirt_1k",
    "C_skirt_5k",
    "C_skirt_10k",
];

/// Settings of the live step on a scene.
#[derive(Clone, Copy)]
struct Variant {
    name: &'static str,
    /// Patches, each on a thread of its own.
    patches: usize,
    self_collision: bool,
    /// Most substeps in 1/60 s; `None`: as many as the fabric needs.
    most_steps: Option<usize>,
}

/// Variants measured, the settings of scenes first.
#[rustfmt::skip]
const VARIANTS: [Variant; 5] = {
    let whole = Variant { name: "live step", patches: 1, self_collision: true, most_steps: None };
    [
        whole,
        Variant { name: "live step, two threads", patches: 2, ..whole },
        Variant { name: "without self-contact", self_collision: false, ..whole },
        Variant { name: "substeps of worn garments", most_steps: Some(72), ..whole },
        Variant { name: "the same on two threads", patches: 2, most_steps: Some(72), ..whole },
    ]
};

impl Variant {
    fn config(&self, scene: &Scene) -> Config {
        let config = scene.config();
        Config {
            patch: scene.start.len().div_ceil(self.patches),
            par: if self.patches > 1 {
                Par::Rayon
            } else {
                Par::Seq
            },
            self_collision: self.self_collision,
            most_steps: self.most_steps.unwrap_or(config.most_steps),
            ..config
        }
    }
}

/// Runs every variant on `scenes` of `folder`; `progress` receives each row.
///
/// # Errors
/// A scene that cannot be read. A variant that diverges is a row with error `diverged` 1.
pub fn cloth(
    folder: &Path,
    scenes: &[String],
    mut progress: impl FnMut(&Row),
) -> Result<Table, EvaluateError> {
    let run_time = "milliseconds for 1/60 s of cloth, median over the scene";
    let mut table = Table::new("cloth", run_time);
    for name in scenes {
        let fault = |e: SceneError| EvaluateError::new(name, e);
        let scene = load(&folder.join(format!("{name}.json"))).map_err(fault)?;
        let reference = reference(folder, name, &scene);
        for variant in &VARIANTS {
            let mut frames = Vec::new();
            let result = run(&scene, &variant.config(&scene), |_, p| {
                frames.push(p.to_vec());
                ControlFlow::Continue(())
            });
            let row = match (&result, &reference) {
                (Ok(r), Some(reference)) => {
                    reference_errors(measured(name, variant, r), &frames, reference)
                }
                (Ok(r), None) => measured(name, variant, r),
                (Err(_), _) => Row::new(name.clone(), variant.name, f64::NAN)
                    .with("patches", variant.patches)
                    .error("diverged", 1.0),
            };
            progress(&row);
            table.rows.push(row);
        }
    }
    Ok(table)
}

fn measured(scene: &str, variant: &Variant, r: &RunReport) -> Row {
    Row::new(scene, variant.name, r.ms_median)
        .with("steps", r.substeps)
        .with("patches", variant.patches)
        .with("stiffness_kept", format!("{:.2}", r.softened))
        .error("strain_p99_percent", r.p99_strain * 100.0)
        .error("penetration_mm", r.penetration * 1e3)
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
