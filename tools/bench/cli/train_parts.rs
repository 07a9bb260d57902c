//! `tryon-bench train-parts`: the part forest, trained on synthetic people.

use crate::args::TrainPartsArgs;
use crate::progress::progress;
use anyhow::{Context, Result};
use std::process::ExitCode;
use tryon::body::embedded;
use tryon::geometry::par::with_threads;
use tryon::synth::labelled::{FRAMES_PER_PERSON, LabelledFrames, TrainingPlan, train_parts};
use tryon::tracking::segment::part_forest::{ForestSpec, PartForest};
use tryon_bench::parts::score_parts;

/// Distance between the seeds of training and test.
const TEST_SEED: u64 = 0x7e57;
/// Steps of the progress bar.
const STEPS: u32 = 1000;

/// Runs the command.
pub(crate) fn run(args: &TrainPartsArgs) -> Result<ExitCode> {
    if args.score {
        score(args)?;
    } else {
        train(args)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Trains a forest and writes it.
fn train(args: &TrainPartsArgs) -> Result<()> {
    let frames = LabelledFrames::new(embedded::template(), args.seed);
    let plan = TrainingPlan {
        images: args.images,
        forest: ForestSpec {
            seed: args.seed,
            ..ForestSpec::default()
        },
        ..TrainingPlan::default()
    };
    let bar = progress(Some(STEPS.into()), "training");
    let forest = with_threads(args.threads, || {
        train_parts(&frames, &plan, &mut |share| {
            bar.set_position((share * f64::from(STEPS)) as u64)
        })
    })?;
    bar.finish_and_clear();
    let (name, bytes) = (args.out.display(), forest.to_bytes());
    std::fs::write(&args.out, &bytes).with_context(|| format!("cannot write {name}"))?;
    let ((trees, splits), size) = (forest.size(), bytes.len());
    println!("{name}: {trees} trees, {splits} splits, {size} bytes");
    Ok(())
}

/// Scores a forest on people it was not trained on.
fn score(args: &TrainPartsArgs) -> Result<()> {
    let name = args.out.display();
    let bytes = std::fs::read(&args.out).with_context(|| format!("cannot read {name}"))?;
    let forest = PartForest::from_bytes(&bytes).with_context(|| format!("{name}"))?;
    let people = args.test_images.div_ceil(FRAMES_PER_PERSON) as u64;
    let test = LabelledFrames::new(embedded::template(), args.seed ^ TEST_SEED);
    print!("{}", score_parts(&forest, &test, people).to_markdown());
    Ok(())
}
