//! Commands and flags of `tryon-bench`.

use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Run time against error, methods side by side: tables as CSV and JSON, plots as SVG.
#[derive(Debug, Parser)]
#[command(
    name = "tryon-bench",
    version,
    propagate_version = true,
    max_term_width = 110
)]
pub(crate) struct Cli {
    /// Component to measure.
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Tracking over iterations, samples, correspondences and metric, on recorded and synthetic sequences.
    Tracking(TrackingArgs),
    /// Cloth on the standard scenes, by the live step or the offline solver.
    Cloth(ClothArgs),
    /// Tracking of everyone who walks in: people, postures and sides from nothing, stills and recordings.
    People(PeopleArgs),
    /// Garment capture on dressed scans with truth: labels, boundaries, surfaces, the body below, other bodies.
    Clothcap(ClothcapArgs),
    /// Query sets of continuous collision detection with truth: missed impacts, false alarms, time a query.
    Ccd(CcdArgs),
    /// Make the embedded body: the same bytes each time.
    MakeBody(MakeBodyArgs),
    /// Train the classifier of body parts on synthetic people, and score it on others.
    TrainParts(TrainPartsArgs),
}

#[derive(Debug, Args)]
pub(crate) struct ClothcapArgs {
    /// Folder for clothcap.csv, .json and one clothcap-*.svg per measure of error.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Folder with clothes, bodies and motions made by others; without it their scenes are skipped.
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// Only scenes whose name contains one of these.
    #[arg(long, value_name = "TEXT", value_delimiter = ',')]
    pub(crate) only: Vec<String>,
    /// The third of the scenes that is kept apart, instead of the other two thirds.
    #[arg(long)]
    pub(crate) unseen: bool,
    /// Also without prior, without smoothness, and with the number of garments given; turns are left out.
    #[arg(long)]
    pub(crate) ablation: bool,
    /// Run time against error instead: points of the scans, lengths and iterations of the part fit; turns are left out.
    /// Minutes a scene.
    #[arg(long, conflicts_with = "ablation")]
    pub(crate) sweep: bool,
    /// Bodies that each outfit is retargeted to.
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub(crate) bodies: usize,
    /// Worker threads; 0 means one per core.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(crate) threads: usize,
}

#[derive(Debug, Args)]
pub(crate) struct PeopleArgs {
    /// Folder for people.md and people.json.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Folder with bodies, motions and recordings; without it their rows are skipped.
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// Only these rows: unlike, shops, poses, sides, limb, stills, shared, uva.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) only: Vec<String>,
    /// A fraction of the cases of each row: two minutes instead of many.
    #[arg(long)]
    pub(crate) quick: bool,
    /// The third of the cases that is kept apart, instead of the other two thirds.
    #[arg(long)]
    pub(crate) unseen: bool,
    /// Folder for a contact sheet per row: depth with true (green) and tracked (red) joints.
    #[arg(long, value_name = "DIR")]
    pub(crate) pictures: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ClothArgs {
    /// Folder for cloth.csv, cloth.json and one cloth-*.svg per measure of error.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Folder of the scenes and their reference positions.
    #[arg(long, value_name = "DIR", default_value = "../shared/data/scenes")]
    pub(crate) scenes: PathBuf,
    /// Only these scenes, by file name without extension.
    #[arg(long, value_name = "NAME")]
    pub(crate) scene: Vec<String>,
    /// Slow variants on the large scenes too (many minutes, with --offline).
    #[arg(long, requires = "offline")]
    pub(crate) full: bool,
    /// The offline solver instead: time schemes, linear solvers, steps, resolutions (cloth-offline.csv …).
    #[arg(long)]
    pub(crate) offline: bool,
    /// Most frames of a scene (with --offline).
    #[arg(long, value_name = "N", requires = "offline")]
    pub(crate) frames: Option<usize>,
    /// The sewn dress on the dancing body of this folder instead of scenes (dress-offline.csv …, with --offline).
    #[arg(long, value_name = "DIR", requires = "offline", conflicts_with_all = ["scene", "full"])]
    pub(crate) dress: Option<PathBuf>,
    /// Vertices of the dress: its longest edges are halved.
    #[arg(long, value_name = "N", default_value_t = 30_000, requires = "dress")]
    pub(crate) vertices: usize,
    /// Threads, 0 for all cores (with --offline).
    #[arg(long, value_name = "N", default_value_t = 0, requires = "offline")]
    pub(crate) threads: usize,
}

#[derive(Debug, Args)]
pub(crate) struct TrackingArgs {
    /// Folder for tracking.csv, tracking.json and one tracking-*.svg per measure of error.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Folder with bodies, motions and sequences that have truth; without it, synthetic scenes of the embedded body.
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// One scene, a third of its frames, a few variants: a minute instead of many.
    #[arg(long)]
    pub(crate) quick: bool,
}

#[derive(Debug, Args)]
pub(crate) struct TrainPartsArgs {
    /// Forest to write (with --score: to read); the same bytes for the same flags on any number of threads.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Score the forest in FILE instead of training one.
    #[arg(long)]
    pub(crate) score: bool,
    /// Folder with itop_stills and msr_action3d, for the score.
    #[arg(long, value_name = "DIR", requires = "score")]
    pub(crate) recordings: Option<PathBuf>,
    /// Training images.
    #[arg(long, default_value_t = 14_000, value_name = "N")]
    pub(crate) images: usize,
    /// Labelled cells an image.
    #[arg(long, default_value_t = 220, value_name = "N")]
    pub(crate) cells: usize,
    /// Trees.
    #[arg(long, default_value_t = 3, value_name = "N")]
    pub(crate) trees: usize,
    /// Splits from the root to the deepest leaf.
    #[arg(long, default_value_t = 18, value_name = "N")]
    pub(crate) depth: usize,
    /// Most splits of a tree.
    #[arg(long, default_value_t = 27_000, value_name = "N")]
    pub(crate) splits: usize,
    /// Random features per node.
    #[arg(long, default_value_t = 112, value_name = "N")]
    pub(crate) features: usize,
    /// Folder with motion clips (.bvh, .amc with .asf) for part of the poses.
    #[arg(long, value_name = "DIR")]
    pub(crate) motions: Option<PathBuf>,
    /// Synthetic images of the score.
    #[arg(long, default_value_t = 1200, value_name = "N")]
    pub(crate) test_images: usize,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(crate) seed: u64,
    /// Worker threads; 0 means one per core.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(crate) threads: usize,
}

#[derive(Debug, Args)]
pub(crate) struct CcdArgs {
    /// Folder tree with CSV files of rational numbers in folders named vertex-face and edge-edge (Wang et al. 2021).
    #[arg(long, value_name = "DIR")]
    pub(crate) queries: PathBuf,
    /// Print JSON instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct MakeBodyArgs {
    /// File to write.
    #[arg(long, value_name = "FILE", default_value = "src/body/embedded.bin")]
    pub(crate) out: PathBuf,
}
