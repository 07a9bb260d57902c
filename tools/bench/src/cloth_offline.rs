//! Offline solver on the standard scenes: time schemes, steps and resolutions against reference positions.

use super::cloth::{reference, reference_errors};
use super::{EvaluateError, Row, Table};
use std::ops::ControlFlow;
use std::path::Path;
use tryon_cloth::fine::{OfflineFrameReport, OfflineSettings, TimeScheme};
use tryon_cloth::scene::{OfflineScene, Scene, load};
use tryon_geometry::math::P3;
use tryon_geometry::math::order_statistics::median;
use tryon_geometry::par::Par;

/// Scenes and extent of the comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct OfflineBench {
    /// Scene names: files of the scenes folder without extension.
    pub scenes: Vec<String>,
    /// All variants on the large scenes too (hours).
    pub full: bool,
    /// Most frames of a scene.
    pub frames: usize,
}

/// Scenes measured: files of the scenes folder without extension.
pub const SCENES: [&str; 4] = ["A_pin_1k", "A_pin_5k", "B_sphere_1k", "C_skirt_1k"];

/// A time scheme and the steps a second.
#[derive(Clone, Copy)]
struct OfflineVariant {
    scheme: TimeScheme,
    /// Steps a second; `None`: as the error allows.
    steps: Option<u32>,
}

/// Variants measured, the defaults first.
const VARIANTS: [OfflineVariant; 7] = {
    use TimeScheme::{Bdf2, ImplicitEuler};
    const fn of(scheme: TimeScheme, steps: Option<u32>) -> OfflineVariant {
        OfflineVariant { scheme, steps }
    }
    [
        of(Bdf2, None),
        of(Bdf2, Some(120)),
        of(Bdf2, Some(240)),
        of(Bdf2, Some(480)),
        of(ImplicitEuler, Some(120)),
        of(ImplicitEuler, Some(240)),
        of(ImplicitEuler, Some(480)),
    ]
};
/// Scenes with more vertices than this run the defaults alone unless asked for.
const LARGE: usize = 2000;

impl OfflineVariant {
    /// Name in tables; rows of one name differ in their steps.
    fn name(&self) -> String {
        let scheme = match self.scheme {
            TimeScheme::Bdf2 => "BDF2",
            TimeScheme::ImplicitEuler => "implicit Euler",
        };
        let steps = self.steps.map_or(", adaptive", |_| "");
        format!("{scheme}{steps}")
    }

    fn settings(&self) -> OfflineSettings {
        let mut settings = OfflineSettings {
            scheme: self.scheme,
            ..OfflineSettings::default()
        };
        if let Some(steps) = self.steps {
            settings.longest_step = 1.0 / f64::from(steps);
            settings.error_rate = f64::INFINITY;
        }
        settings
    }
}

/// Runs the variants on every scene of `folder`; `progress` receives each row.
///
/// # Errors
/// A scene that cannot be read or simulated. A step that is not solved is a row with error `unsolved` 1.
pub fn cloth_offline(
    folder: &Path,
    bench: &OfflineBench,
    mut progress: impl FnMut(&Row),
) -> Result<Table, EvaluateError> {
    let run_time = "milliseconds for 1/60 s of cloth, median over the scene";
    let mut table = Table::new("cloth-offline", run_time);
    for scene_name in &bench.scenes {
        let fault = |why: String| EvaluateError::new(scene_name, why);
        let path = folder.join(format!("{scene_name}.json"));
        let scene = load(&path).map_err(|e| fault(e.to_string()))?;
        let offline = OfflineScene::new(&scene).map_err(|e| fault(e.to_string()))?;
        let reference = reference(folder, scene_name, &scene);
        let is_large = scene.start.len() > LARGE && !bench.full;
        for variant in VARIANTS
            .into_iter()
            .take(if is_large { 1 } else { VARIANTS.len() })
        {
            let run = Run::of(&scene, &offline, &variant, bench.frames);
            let row = run.row(scene_name, &variant);
            let row = match &reference {
                Some(reference) => reference_errors(row, &run.frames, reference),
                None => row,
            };
            progress(&row);
            table.rows.push(row);
        }
    }
    Ok(table)
}

/// Measurements of one run.
struct Run {
    vertices: usize,
    /// Frames of the scene a second.
    rate: f64,
    /// Positions (m), the start first.
    frames: Vec<Vec<P3>>,
    work: Vec<OfflineFrameReport>,
    /// Computing time of each frame (s).
    seconds: Vec<f64>,
    is_solved: bool,
}

impl Run {
    fn of(
        scene: &Scene,
        offline: &OfflineScene<'_>,
        variant: &OfflineVariant,
        most: usize,
    ) -> Self {
        let mut run = Self {
            vertices: scene.start.len(),
            rate: scene.rate,
            frames: vec![scene.start.clone()],
            work: Vec::new(),
            seconds: Vec::new(),
            is_solved: true,
        };
        let mut before = 0.0;
        let end = offline.run(&variant.settings(), Par::Rayon, None, |done, solver| {
            run.frames.push(solver.state().positions());
            run.work.push(done.report);
            run.seconds.push(done.seconds[0] - before);
            before = done.seconds[0];
            if run.frames.len() < most {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        });
        run.is_solved = end.is_ok();
        run
    }

    /// Row without the distances from a reference.
    fn row(&self, scene: &str, variant: &OfflineVariant) -> Row {
        let median = median(&mut self.seconds.clone()).unwrap_or(f64::NAN);
        let sum = |count: fn(&OfflineFrameReport) -> usize| -> usize {
            self.work.iter().map(count).sum()
        };
        let mean = |total: usize| total as f64 / self.work.len().max(1) as f64;
        Row::new(scene, variant.name(), median * self.rate / 60.0 * 1e3)
            .with("vertices", self.vertices)
            .with("steps_per_frame", format!("{:.1}", mean(sum(|w| w.steps))))
            .with(
                "newton_per_frame",
                format!("{:.1}", mean(sum(|w| w.newton.iterations))),
            )
            .with(
                "asleep_per_frame",
                format!("{:.0}", mean(sum(|w| w.asleep))),
            )
            .with("repeated_steps", sum(|w| w.inaccurate + w.unsolved))
            .error("unsolved", f64::from(u8::from(!self.is_solved)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_steps_ignore_the_error() {
        let fixed = VARIANTS[3].settings();
        assert!(fixed.error_rate.is_infinite());
        assert!((fixed.longest_step - 1.0 / 480.0).abs() < 1e-12);
        assert_eq!(VARIANTS[0].settings(), OfflineSettings::default());
        assert_eq!(VARIANTS[0].name(), "BDF2, adaptive");
    }
}
