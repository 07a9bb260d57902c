//! `tryon simulate`: cloth in a scene file.

use crate::args::{SimulateArgs, SolverArg};
use crate::input;
use crate::report::write;
use anyhow::Result;
use std::ops::ControlFlow;
use std::process::ExitCode;
use tryon::cloth::scene;

/// Runs the command.
///
/// # Errors
/// A scene at fault, named by field, or results that cannot be written.
pub(crate) fn run(args: &SimulateArgs) -> Result<ExitCode> {
    let scene = scene::load(&args.scene)?;
    input::create_dir(&args.out)?;
    let config = match args.solver {
        SolverArg::Realtime => scene::RunConfig::default(),
        SolverArg::Offline => scene::RunConfig::offline(),
    };
    let bar = input::progress(Some(scene.frames() as u64), "simulating");
    let mut frames = Vec::with_capacity(scene.frames());
    let report = scene::run(&scene, &config, |_, positions| {
        frames.push(positions.to_vec());
        bar.inc(1);
        ControlFlow::Continue(())
    })?;
    bar.finish_and_clear();
    scene::write_positions(&args.out.join("positions.npy"), &frames)?;
    write(&args.out.join("report.json"), &report)?;
    if report.unconverged > 0 {
        eprintln!(
            "warning: {} steps did not converge; see report.json",
            report.unconverged
        );
    }
    println!("{} frames in {}", scene.frames(), args.out.display());
    Ok(ExitCode::SUCCESS)
}
