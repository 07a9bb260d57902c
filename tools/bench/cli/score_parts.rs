//! `tryon-bench score-parts`: the network of body parts on synthetic people that it was not trained on, and on recordings.

use crate::args::ScorePartsArgs;
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use tryon::body::embedded;
use tryon::synth::labelled::{FRAMES_PER_PERSON, LabelledFrames};
use tryon::tracking::segment::part_network::PartNetwork;
use tryon_bench::parts::score_parts;
use tryon_bench::parts_recorded::{RecordedScores, score_recording};

/// Distance between the seeds of training and test.
const TEST_SEED: u64 = 0x7e57;

/// Runs the command.
pub(crate) fn run(args: &ScorePartsArgs) -> Result<ExitCode> {
    let network = match &args.network {
        Some(file) => {
            let name = file.display();
            let bytes = std::fs::read(file).with_context(|| format!("cannot read {name}"))?;
            Arc::new(PartNetwork::from_bytes(&bytes).with_context(|| format!("{name}"))?)
        }
        None => PartNetwork::embedded(),
    };
    let people = args.images.div_ceil(FRAMES_PER_PERSON) as u64;
    let test = LabelledFrames::new(embedded::template(), args.seed ^ TEST_SEED);
    print!("{}", score_parts(&network, &test, people).to_markdown());
    if let Some(folder) = &args.recordings {
        let template = embedded::template();
        let stills = score_recording(&network, &template, &folder.join("itop_stills"))?;
        print!("{}", stills.to_markdown("ITOP stills"));
        let mut videos = RecordedScores::default();
        for video in subfolders(&folder.join("msr_action3d"))? {
            videos.add(&score_recording(&network, &template, &video)?);
        }
        print!("{}", videos.to_markdown("MSR-Action3D"));
    }
    Ok(ExitCode::SUCCESS)
}

/// Folders in a folder, by name.
fn subfolders(folder: &Path) -> Result<Vec<PathBuf>> {
    let name = folder.display();
    let entries = std::fs::read_dir(folder).with_context(|| format!("cannot read {name}"))?;
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
