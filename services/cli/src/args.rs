//! Commands and flags of the command line.

mod clothcap;
mod fine;
mod identity;
mod offline;
mod serve;
mod token;

pub(crate) use clothcap::{
    ClothcapAlignArgs, ClothcapArgs, ClothcapCaptureArgs, ClothcapRetargetArgs,
    ClothcapSegmentArgs, ClothcapWhat, ScanArgs, ScanFrameArgs, Shard,
};
pub(crate) use fine::FineSessionArgs;
pub(crate) use identity::{IdentityArgs, IdentityIssueArgs, IdentityMakeArgs, IdentityWhat};
pub(crate) use offline::{FineArgs, SolverArgs};
pub(crate) use serve::{DemoArgs, UpArgs};
pub(crate) use token::{
    AudienceArg, ClaimArgs, TokenArgs, TokenEnrolArgs, TokenIssueArgs, TokenKeyArgs,
    TokenRedeemArgs, TokenRevokeArgs, TokenWhat,
};

use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Live virtual try-on: a depth camera records a person, the mirror shows the person in other garments.
#[derive(Debug, Parser)]
#[command(
    name = "tryon",
    version,
    propagate_version = true,
    max_term_width = 110
)]
pub(crate) struct Cli {
    /// Command to run.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Log filter, for example `info` or `tryon_tracking=debug`; without one `warn`, and for `up` what its [log] says. Logs go
    /// to standard error.
    #[arg(long, global = true, env = "TRYON_LOG")]
    pub(crate) log: Option<String>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run the whole chain in this process on a synthetic person: nothing to install, no camera, no GPU.
    ///
    /// Opens the mirror on http://127.0.0.1:8080. With --headless it needs no browser and leaves pictures and
    /// report.json in --out.
    Demo(DemoArgs),
    /// Run the services of one box from a configuration file, and restart any that ends.
    Up(UpArgs),
    /// Dress the person in a recording: composited PNGs and report.json.
    Run(RunArgs),
    /// Track the person in a recording: one JSON line a frame.
    Track(TrackArgs),
    /// Simulate cloth in a scene file: positions.npy and report.json.
    Simulate(SimulateArgs),
    /// Simulate the garments of a live session on finer meshes, in the cloth service: positions.npy, outfit.glb and
    /// report.json.
    Fine(FineSessionArgs),
    /// Draw garment meshes (in the camera's frame) into one captured picture.
    Composite(CompositeArgs),
    /// Ask query sets of continuous collision detection with truth: missed impacts, false alarms, time a query.
    Ccd(CcdArgs),
    /// Garments from 3D scans of a person: align, segment, capture, and dress other bodies.
    Clothcap(ClothcapArgs),
    /// Check a body, garment or recording made elsewhere and convert it to this product's own form.
    Import(ImportArgs),
    /// Write the embedded body or a garment to OBJ, glTF or JSON.
    Export(ExportArgs),
    /// Record a source (the synthetic person, a folder, or a running camera node) to MCAP or a folder.
    Record(RecordArgs),
    /// Publish a recording as if it were a live camera.
    Replay(ReplayArgs),
    /// Train the classifier of body parts on synthetic people, and score it on others.
    TrainParts(TrainPartsArgs),
    /// Run time against error, methods side by side: tables as CSV and JSON, plots as SVG.
    Bench(BenchArgs),
    /// Keys, tokens and enrolment codes: who may call the services.
    Token(TokenArgs),
    /// The authority by which a store's services know each other, and certificates of it.
    Identity(IdentityArgs),
    /// Check this machine: cores, memory, graphics adapter, ports, shared data; report expected faults.
    Doctor(DoctorArgs),
}

#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    /// An .mcap file, or a folder with camera.json, depth/ and maybe rgb/.
    #[arg(long, value_name = "REC")]
    pub(crate) input: PathBuf,
    /// Garments: names (see `tryon export --list`), pattern files (.json, ours or GarmentCode's), layered as they say, or
    /// meshes (.obj with or without stitches, .glb, .gltf, MakeHuman's .mhclo), or captures (the folder that `tryon
    /// clothcap capture` wrote for all its garments, FOLDER/top, FOLDER/under, FOLDER/bottom … for one).
    #[arg(long = "garment", value_name = "NAME|FILE|CAPTURE", required = true)]
    pub(crate) garments: Vec<String>,
    /// The body that mesh garments were made on (.npz in SMPL layout, or an .obj that stands upright; MakeHuman clothes:
    /// its base mesh with the helpers). Without it the garment's own place and size are guessed from.
    #[arg(long, value_name = "NPZ|OBJ")]
    pub(crate) garment_body: Option<PathBuf>,
    /// Size for all garments but pattern files and meshes on a guessed body; without it each is chosen from the tracked
    /// body.
    #[arg(long, value_name = "SIZE")]
    pub(crate) size: Option<String>,
    /// Folder for frame pictures, report.json and, by the offline solver, positions.npy (cloth), body.npy (both frames ×
    /// vertices × 3, f32) and outfit.glb of both.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Body template in SMPL layout; the embedded body without it.
    #[arg(long, value_name = "NPZ")]
    pub(crate) body: Option<PathBuf>,
    /// Stop after so many frames.
    #[arg(long, value_name = "N")]
    pub(crate) frames: Option<usize>,
    /// Frames a still picture is repeated for, so that calibration and draping can settle.
    #[arg(long, value_name = "N", default_value_t = 45)]
    pub(crate) still_frames: usize,
    /// Solver, checkpoint.
    #[command(flatten)]
    pub(crate) solver: SolverArgs,
    /// Extent of the offline simulation.
    #[command(flatten)]
    pub(crate) fine: FineArgs,
    /// Also draw the tracked body over the picture (frame_*_body.png).
    #[arg(long)]
    pub(crate) overlay: bool,
    /// Worker threads; 0 means one per core.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(crate) threads: usize,
}

#[derive(Debug, Args)]
pub(crate) struct TrackArgs {
    /// An .mcap file, or a folder with camera.json and depth/.
    #[arg(long, value_name = "REC")]
    pub(crate) input: PathBuf,
    /// Body template in SMPL layout; the embedded body without it.
    #[arg(long, value_name = "NPZ")]
    pub(crate) body: Option<PathBuf>,
    /// Rough start: {"root_position": [x, y, z], "facing_yaw_deg": d} in the camera frame.
    #[arg(long, value_name = "JSON")]
    pub(crate) init: Option<PathBuf>,
    /// One line of JSON a frame.
    #[arg(long, value_name = "FILE.jsonl")]
    pub(crate) out: PathBuf,
    /// Also write the tracked surface of every frame as OBJ into this folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) meshes: Option<PathBuf>,
    /// Also draw the body over every depth image as PNG into this folder: green on the measured surface, red in free
    /// space, blue behind it, orange where nothing was measured; grey alone without a live pose.
    #[arg(long, value_name = "DIR")]
    pub(crate) overlay: Option<PathBuf>,
    /// Worker threads; 0 means one per core.
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub(crate) threads: usize,
}

#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    /// Scene file: mesh, pinned vertices, colliders, material, duration.
    #[arg(long, value_name = "SCENE.json")]
    pub(crate) scene: PathBuf,
    /// Solver, checkpoint.
    #[command(flatten)]
    pub(crate) solver: SolverArgs,
    /// Lets cloth pass through itself and through solids (offline solver).
    #[arg(long)]
    pub(crate) no_contact: bool,
    /// Computes every frame whole: nothing that is still is left out (offline solver).
    #[arg(long)]
    pub(crate) no_sleep: bool,
    /// Folder for positions.npy (frames × vertices × 3, f32), report.json and, by the offline solver, animation.glb.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct CompositeArgs {
    /// The captured colour picture (PNG or JPEG).
    #[arg(long, value_name = "PNG")]
    pub(crate) color: PathBuf,
    /// Its depth (16-bit PNG, registered to the colour).
    #[arg(long, value_name = "PNG")]
    pub(crate) depth: PathBuf,
    /// Intrinsics as in a recording's camera.json.
    #[arg(long, value_name = "JSON")]
    pub(crate) camera: PathBuf,
    /// Garment meshes in the camera's frame, metres.
    #[arg(long = "garment", value_name = "OBJ|GLB", required = true)]
    pub(crate) garments: Vec<PathBuf>,
    /// The picture to write.
    #[arg(long, value_name = "PNG")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct ImportArgs {
    /// A body (.npz in SMPL layout), a garment (.obj with or without stitches, .glb, MakeHuman's .mhclo, a sewing pattern
    /// of ours or GarmentCode's .json), a measured fabric (.json), or a recording (.mcap or folder).
    #[arg(value_name = "FILE")]
    pub(crate) input: PathBuf,
    /// Checked copy to write (.obj or .glb for bodies and garments, .json for patterns, .mcap or a folder for
    /// recordings).
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// `body`, or a garment name.
    #[arg(value_name = "WHAT", required_unless_present = "list")]
    pub(crate) what: Option<String>,
    /// .obj or .glb for meshes; .json for a garment's sewing pattern.
    #[arg(long, value_name = "FILE", required_unless_present = "list")]
    pub(crate) out: Option<PathBuf>,
    /// Garment size.
    #[arg(long, default_value = "M", value_name = "SIZE")]
    pub(crate) size: String,
    /// The garment as worn by the embedded body instead of flat as cut.
    #[arg(long)]
    pub(crate) worn: bool,
    /// With --worn: this many seconds of the try-on routine as animation (.glb).
    #[arg(long, default_value_t = 0.0, value_name = "S", requires = "worn")]
    pub(crate) seconds: f64,
    /// List what can be exported.
    #[arg(long)]
    pub(crate) list: bool,
}

#[derive(Debug, Args)]
pub(crate) struct RecordArgs {
    /// Source of the frames: `synth` (or `synth:leave`, `synth:still`, `synth:seated`, `synth:empty`), a recording to convert, or
    /// `bus:STORE/CAMERA`, a camera that runs now.
    #[arg(long, default_value = "synth", value_name = "SOURCE")]
    pub(crate) source: String,
    /// An .mcap file, or a folder.
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) out: PathBuf,
    /// Length of the recording, seconds.
    #[arg(long, default_value_t = 10.0, value_name = "S")]
    pub(crate) seconds: f64,
    /// Confirms that the person in the picture agreed to being recorded. Body images are biometric data.
    #[arg(long)]
    pub(crate) consent: bool,
    /// Configuration file with the bus endpoints (see `up`).
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ReplayArgs {
    /// The recording.
    #[arg(long, value_name = "REC")]
    pub(crate) input: PathBuf,
    /// Start again at the end.
    #[arg(long)]
    pub(crate) repeat: bool,
    /// As fast as possible instead of at the recorded rate.
    #[arg(long)]
    pub(crate) fast: bool,
    /// Configuration file with the bus endpoints (see `up`).
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct BenchArgs {
    /// Component to measure.
    #[command(subcommand)]
    pub(crate) what: BenchWhat,
}

#[derive(Debug, Subcommand)]
pub(crate) enum BenchWhat {
    /// Tracking over iterations, samples, correspondences and metric, on recorded and synthetic sequences.
    Tracking(BenchTrackingArgs),
    /// Cloth solvers on the standard scenes: small steps, XPBD, quasi-Newton, the paper's mass-spring step.
    Cloth(BenchClothArgs),
    /// Tracking of everyone who walks in: people, postures and sides from nothing, stills and recordings.
    People(BenchPeopleArgs),
    /// Garment capture on dressed scans with truth: labels, boundaries, surfaces, the body below, other bodies.
    Clothcap(BenchClothcapArgs),
}

#[derive(Debug, Args)]
pub(crate) struct BenchClothcapArgs {
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
pub(crate) struct BenchPeopleArgs {
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
pub(crate) struct BenchClothArgs {
    /// Folder for cloth.csv, cloth.json and one cloth-*.svg per measure of error.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Folder of the scenes and their reference positions.
    #[arg(long, value_name = "DIR", default_value = "../shared/data/scenes")]
    pub(crate) scenes: PathBuf,
    /// Only these scenes, by file name without extension.
    #[arg(long, value_name = "NAME")]
    pub(crate) scene: Vec<String>,
    /// Slow methods on the large scenes too (many minutes).
    #[arg(long)]
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
pub(crate) struct BenchTrackingArgs {
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
pub(crate) struct DoctorArgs {
    /// Print JSON instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}
