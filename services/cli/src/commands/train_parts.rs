//! `tryon train-parts`: the part forest, trained on synthetic people.

use crate::args::TrainPartsArgs;
use crate::input;
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use tryon::body::embedded;
use tryon::evaluate::parts::score_parts;
use tryon::formats::{MotionClip, read_motion};
use tryon::par::with_threads;
use tryon::segment::part_forest::ForestSpec;
use tryon::synth::labelled::{FRAMES_PER_PERSON, LabelledFrames, TrainingPlan, train_parts};

/// Distance between the seeds of training and test.
const TEST_SEED: u64 = 0x7e57;
/// Steps of the progress bar.
const STEPS: f64 = 1000.0;

/// Runs the command.
///
/// # Errors
/// Clips that cannot be read or played, or a file that cannot be written.
pub(crate) fn run(args: &TrainPartsArgs) -> Result<ExitCode> {
    let (clips, held_out) = clips(args)?;
    let template = embedded::template();
    let frames = LabelledFrames::new(template.clone(), clips.clone(), args.seed)?;
    let plan = TrainingPlan {
        images: args.images,
        cells: args.cells,
        forest: ForestSpec {
            trees: args.trees,
            depth: args.depth,
            splits: args.splits,
            features: args.features,
            seed: args.seed,
            ..ForestSpec::default()
        },
    };
    let bar = input::progress(Some(STEPS as u64), "training");
    let forest = with_threads(args.threads, || {
        train_parts(&frames, &plan, &mut |share| bar.set_position((share * STEPS) as u64))
    })?;
    bar.finish_and_clear();
    let bytes = forest.to_bytes();
    std::fs::write(&args.out, &bytes)
        .with_context(|| format!("cannot write {}", args.out.display()))?;
    let (trees, splits) = forest.size();
    println!(
        "{}: {trees} trees, {splits} splits, {} bytes",
        args.out.display(),
        bytes.len()
    );
    let people = args.test_images.div_ceil(FRAMES_PER_PERSON) as u64;
    if people > 0 {
        let clips = if held_out.is_empty() { clips } else { held_out };
        let test = LabelledFrames::new(template, clips, args.seed ^ TEST_SEED)?;
        print!("{}", score_parts(&forest, &test, people).to_markdown());
    }
    Ok(ExitCode::SUCCESS)
}

/// Clips to train on, and clips held out for the test, each in the order of their names.
fn clips(args: &TrainPartsArgs) -> Result<(Vec<MotionClip>, Vec<MotionClip>)> {
    let (mut train, mut test) = (Vec::new(), Vec::new());
    let Some(folder) = &args.motions else {
        return Ok((train, test));
    };
    let mut files = Vec::new();
    motion_files(folder, &mut files)?;
    files.sort();
    for file in files {
        let stem = file.file_stem().map(|s| s.to_string_lossy().into_owned());
        let clip = read_motion(&file)?;
        if args.hold_out.iter().any(|h| Some(h) == stem.as_ref()) {
            test.push(clip);
        } else {
            train.push(clip);
        }
    }
    Ok((train, test))
}

/// All .bvh and .amc files below a folder.
fn motion_files(folder: &Path, out: &mut Vec<PathBuf>) -> Result<()> {
    let entries = std::fs::read_dir(folder)
        .with_context(|| format!("cannot read {}", folder.display()))?;
    for entry in entries {
        let path = entry?.path();
        if path.is_dir() {
            motion_files(&path, out)?;
        } else if path.extension().is_some_and(|e| e == "bvh" || e == "amc") {
            out.push(path);
        }
    }
    Ok(())
}
