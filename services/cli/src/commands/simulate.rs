//! `tryon simulate`: cloth in a scene file.

use crate::args::{SimulateArgs, SolverArg};
use crate::input;
use crate::report::write;
use anyhow::Result;
use indicatif::ProgressBar;
use serde::Serialize;
use std::ops::ControlFlow;
use std::process::ExitCode;
use tryon::cloth::scene::{self, RunConfig, RunReport, Scene};
use tryon::math::P3;
use tryon::offline::{OfflineFrameReport, OfflineScene, OfflineSettings};
use tryon::par::Par;

/// Runs the command.
///
/// # Errors
/// A scene at fault, named by field, or results that cannot be written.
pub(crate) fn run(args: &SimulateArgs) -> Result<ExitCode> {
    let scene = scene::load(&args.scene)?;
    input::create_dir(&args.out)?;
    let bar = input::progress(Some(scene.frames() as u64), "simulating");
    let mut frames = Vec::with_capacity(scene.frames());
    let report = args.out.join("report.json");
    match args.solver {
        SolverArg::Realtime => {
            let done = realtime(&scene, &bar, &mut frames)?;
            write(&report, &done)?;
        }
        SolverArg::Offline => {
            let mut settings = OfflineSettings::default();
            settings.contact = settings.contact.filter(|_| !args.no_contact);
            let done = offline(&scene, &settings, &bar, &mut frames)?;
            write(&report, &done)?;
        }
    }
    bar.finish_and_clear();
    scene::write_positions(&args.out.join("positions.npy"), &frames)?;
    println!("{} frames in {}", frames.len(), args.out.display());
    Ok(ExitCode::SUCCESS)
}

/// Fills `frames` by the real-time solver.
fn realtime(scene: &Scene, bar: &ProgressBar, frames: &mut Vec<Vec<P3>>) -> Result<RunReport> {
    let report = scene::run(scene, &RunConfig::default(), |_, positions| {
        frames.push(positions.to_vec());
        bar.inc(1);
        ControlFlow::Continue(())
    })?;
    if report.unconverged > 0 {
        eprintln!(
            "warning: {} steps did not converge; see report.json",
            report.unconverged
        );
    }
    Ok(report)
}

/// Report of the offline solver.
#[derive(Serialize)]
struct OfflineRun {
    /// Frames of the output, the start included.
    frames: usize,
    vertices: usize,
    /// Computing time of all frames (s).
    seconds: f64,
    /// Work of each frame but the start.
    work: Vec<OfflineFrameReport>,
}

/// Fills `frames` by the offline solver.
fn offline(
    scene: &Scene,
    settings: &OfflineSettings,
    bar: &ProgressBar,
    frames: &mut Vec<Vec<P3>>,
) -> Result<OfflineRun> {
    frames.push(scene.start.clone());
    bar.inc(1);
    let (mut work, mut seconds) = (Vec::new(), 0.0);
    let offline = OfflineScene::new(scene)?;
    offline.run(settings, Par::Rayon, |done, positions| {
        frames.push(positions.to_vec());
        work.push(done.report);
        seconds = done.seconds[0];
        bar.inc(1);
        ControlFlow::Continue(())
    })?;
    Ok(OfflineRun {
        frames: frames.len(),
        vertices: scene.start.len(),
        seconds,
        work,
    })
}
