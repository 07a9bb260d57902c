//! Flags of `tryon clothcap`.

use super::BodyArgs;
use crate::recording::RecordingArgs;
use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;
use tryon::formats::mesh_frame::metres_per_unit;

#[derive(Debug, Args)]
pub(crate) struct ClothcapArgs {
    /// Stage to run.
    #[command(subcommand)]
    pub(crate) what: ClothcapWhat,
}

#[derive(Debug, Subcommand)]
pub(crate) enum ClothcapWhat {
    /// Align the body template to each scan: NAME.ply and report.json.
    Align(ClothcapAlignArgs),
    /// Label the points of each scan by garment: NAME.ply with `label`, and labels.json.
    Segment(ClothcapSegmentArgs),
    /// Capture the garments and the body under them. A stopped capture continues where it ended.
    Capture(ClothcapCaptureArgs),
    /// Dress other bodies in a capture: NAME.glb with skin and morph targets, report.json, a contact sheet.
    Retarget(ClothcapRetargetArgs),
}

/// Scans of one subject.
#[derive(Clone, Debug, Args)]
pub(crate) struct ScanArgs {
    /// A scan (.ply, .obj, .glb, .gltf), or a folder of them: a sequence.
    #[arg(long, value_name = "DIR|FILE")]
    pub(crate) scans: PathBuf,
    #[command(flatten)]
    pub(crate) frame: ScanFrameArgs,
}

/// Body, units and axes of scans.
#[derive(Clone, Debug, Args)]
pub(crate) struct ScanFrameArgs {
    #[command(flatten)]
    pub(crate) body: BodyArgs,
    /// Unit of the scans: m, dm, cm, mm, inch, foot, or metres as a number. Without it unit and up axis are found.
    #[arg(long, value_parser = metres_per_unit, value_name = "UNIT")]
    pub(crate) unit: Option<f64>,
    /// Direction against gravity in the scans (with --unit).
    #[arg(long, value_name = "AXIS", default_value = "y", requires = "unit")]
    pub(crate) up: UpAxis,
    /// Worker threads; 0 means one per core.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(crate) threads: usize,
}

/// Direction against gravity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum UpAxis {
    X,
    Y,
    Z,
    #[value(name = "-x")]
    MinusX,
    #[value(name = "-y")]
    MinusY,
    #[value(name = "-z")]
    MinusZ,
}

impl UpAxis {
    /// Unit vector.
    pub(crate) fn vector(self) -> [f64; 3] {
        match self {
            Self::X => [1.0, 0.0, 0.0],
            Self::Y => [0.0, 1.0, 0.0],
            Self::Z => [0.0, 0.0, 1.0],
            Self::MinusX => [-1.0, 0.0, 0.0],
            Self::MinusY => [0.0, -1.0, 0.0],
            Self::MinusZ => [0.0, 0.0, -1.0],
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct ClothcapAlignArgs {
    #[command(flatten)]
    pub(crate) scans: ScanArgs,
    /// Folder for results.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct ClothcapSegmentArgs {
    #[command(flatten)]
    pub(crate) scans: ScanArgs,
    /// Garments worn: some of top, under, bottom, one_piece, shoes with commas between, or a JSON file
    /// {"garments": [...]}; without it they are found.
    #[arg(long, value_name = "NAMES|FILE")]
    pub(crate) prior: Option<String>,
    /// Folder for results.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
#[command(group(clap::ArgGroup::new("source").required(true).args(["scans", "input"])))]
pub(crate) struct ClothcapCaptureArgs {
    /// A scan (.ply, .obj, .glb, .gltf), or a folder of them: a sequence.
    #[arg(long, value_name = "DIR|FILE", conflicts_with = "RecordingArgs")]
    pub(crate) scans: Option<PathBuf>,
    /// A recording (any that `tryon run` reads) of one colour and depth camera before which the subject turns around once;
    /// one frame gives what it shows, completed from the body.
    #[arg(long, value_name = "REC", conflicts_with = "unit")]
    pub(crate) input: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) recording: RecordingArgs,
    #[command(flatten)]
    pub(crate) frame: ScanFrameArgs,
    /// Garments worn, as for segment; without it they are found.
    #[arg(long, value_name = "NAMES|FILE")]
    pub(crate) prior: Option<String>,
    /// A scan of the subject in minimal clothing: it gives the body under the clothes. Without it up to four scans of the
    /// sequence do.
    #[arg(long, value_name = "FILE")]
    pub(crate) minimal: Option<PathBuf>,
    /// Skips nothing: no point keeps its place from iteration to iteration, no unchanged scan the result of the one before.
    #[arg(long)]
    pub(crate) no_skip: bool,
    /// Folder for results: capture.json, frames/, textures/, pictures/, report.json; of a recording also turn.ply and turn.json.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
}

/// One of several jobs of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    /// Number of this job, from 0.
    pub(crate) index: usize,
    /// Number of jobs.
    pub(crate) count: usize,
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let fault = || format!("`{text}`: expected K/N with K below N, for example 2/8");
        let (index, count) = text.split_once('/').ok_or_else(fault)?;
        let number = |t: &str| t.parse::<usize>().map_err(|_| fault());
        let shard = Self {
            index: number(index)?,
            count: number(count)?,
        };
        if shard.index < shard.count {
            Ok(shard)
        } else {
            Err(fault())
        }
    }
}

#[derive(Debug, Args)]
#[command(group(clap::ArgGroup::new("bodies").required(true).args(["body", "population"])))]
pub(crate) struct ClothcapRetargetArgs {
    /// Folder of a capture.
    #[arg(long, value_name = "DIR")]
    pub(crate) capture: PathBuf,
    #[command(flatten)]
    pub(crate) body: BodyArgs,
    /// Number of bodies drawn from the shape space.
    #[arg(long, value_name = "N")]
    pub(crate) population: Option<usize>,
    /// Only the bodies K, K + N, K + 2N …, as K/N: independent jobs of one batch. Bodies that are done are left alone.
    #[arg(long, value_name = "K/N", default_value = "0/1")]
    pub(crate) shard: Shard,
    /// Motion clip (.bvh, or .amc beside its .asf) instead of the captured poses.
    #[arg(long, value_name = "CLIP")]
    pub(crate) motion: Option<PathBuf>,
    /// Seed of the population.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Also NAME.obj of the first pose, with NAME.mtl and the garments' textures.
    #[arg(long)]
    pub(crate) obj: bool,
    /// Folder for results.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Worker threads; 0 means one per core.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(crate) threads: usize,
}
