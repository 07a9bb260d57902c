//! `tryon-bench render-people`: the synthetic people from which the network of body parts is trained.

use crate::args::RenderPeopleArgs;
use crate::progress::progress;
use anyhow::{Context, Result};
use std::fs::File;
use std::io::BufWriter;
use std::process::ExitCode;
use tryon::body::embedded;
use tryon::geometry::par::with_threads;
use tryon::synth::labelled::LabelledFrames;

/// Steps of the progress bar.
const STEPS: u32 = 1000;

/// Runs the command.
pub(crate) fn run(args: &RenderPeopleArgs) -> Result<ExitCode> {
    let frames = LabelledFrames::new(embedded::template(), args.seed);
    let name = args.out.display();
    let file = File::create(&args.out).with_context(|| format!("cannot write {name}"))?;
    let mut file = BufWriter::new(file);
    let bar = progress(Some(STEPS.into()), "rendering");
    with_threads(args.threads, || {
        frames.write_crops(args.people, &mut file, &mut |share| {
            bar.set_position((share * f64::from(STEPS)) as u64)
        })
    })?
    .with_context(|| format!("cannot write {name}"))?;
    bar.finish_and_clear();
    Ok(ExitCode::SUCCESS)
}
