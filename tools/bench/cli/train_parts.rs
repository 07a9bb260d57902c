//! `tryon-bench train-parts`: the part forest, trained on synthetic people.

use crate::args::TrainPartsArgs;
use crate::progress::progress;
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use tryon::body::embedded;
use tryon::formats::{MotionClip, read_motion};
use tryon::geometry::par::with_threads;
use tryon::synth::labelled::{FRAMES_PER_PERSON, LabelledFrames, TrainingPlan, train_parts};
use tryon::tracking::segment::part_forest::{ForestSpec, PartForest};
use tryon_bench::parts::score_parts;
use tryon_bench::parts_recorded::{RecordedScores, score_recording};

/// Distance between the seeds of training and test.
const TEST_SEED: u64 = 0x7e57;
/// Steps of the progress bar.
const STEPS: f64 = 1000.0;

/// Runs the command.
///
/// # Errors
/// Clips or recordings that cannot be read, a forest that cannot be read or written.
pub(crate) fn run(args: &TrainPartsArgs) -> Result<ExitCode> {
    let clips = clips(args)?;
    if args.score {
        score(args, clips)?;
    } else {
        train(args, clips)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Trains a forest and writes it.
fn train(args: &TrainPartsArgs, clips: Vec<MotionClip>) -> Result<()> {
    let frames = LabelledFrames::new(embedded::template(), clips, args.seed)?;
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
    let bar = progress(Some(STEPS as u64), "training");
    let forest = with_threads(args.threads, || {
        train_parts(&frames, &plan, &mut |share| {
            bar.set_position((share * STEPS) as u64)
        })
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
    Ok(())
}

/// Scores a forest on people it was not trained on, and on recordings.
fn score(args: &TrainPartsArgs, clips: Vec<MotionClip>) -> Result<()> {
    let name = args.out.display();
    let bytes = std::fs::read(&args.out).with_context(|| format!("cannot read {name}"))?;
    let forest = PartForest::from_bytes(&bytes).with_context(|| format!("{name}"))?;
    let template = embedded::template();
    let people = args.test_images.div_ceil(FRAMES_PER_PERSON) as u64;
    if people > 0 {
        let test = LabelledFrames::new(template.clone(), clips, args.seed ^ TEST_SEED)?;
        println!(
            "synthetic: {}",
            score_parts(&forest, &test, people).to_markdown()
        );
    }
    if let Some(folder) = &args.recordings {
        let stills = score_recording(&forest, &template, &folder.join("itop_stills"))?;
        print!("{}", stills.to_markdown("ITOP stills"));
        let mut videos = RecordedScores::default();
        for video in subfolders(&folder.join("msr_action3d"))? {
            videos.add(&score_recording(&forest, &template, &video)?);
        }
        print!("{}", videos.to_markdown("MSR-Action3D"));
    }
    Ok(())
}

/// Folders in a folder, by name.
fn subfolders(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries =
        std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut out = Vec::new();
    for entry in entries {
        let path = entry?.path();
        if path.is_dir() {
            out.push(path);
        }
    }
    out.sort();
    Ok(out)
}

/// Clips for part of the poses, in the order of their files.
fn clips(args: &TrainPartsArgs) -> Result<Vec<MotionClip>> {
    let Some(folder) = &args.motions else {
        return Ok(vec![]);
    };
    let mut files = Vec::new();
    motion_files(folder, &mut files)?;
    files.sort();
    files.iter().map(|f| Ok(read_motion(f)?)).collect()
}

/// All .bvh and .amc files below a folder.
fn motion_files(folder: &Path, out: &mut Vec<PathBuf>) -> Result<()> {
    let entries =
        std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
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
