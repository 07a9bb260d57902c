//! Commands and flags of `tryon-bench`.

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use tryon_bench::OutfitSpec;
use tryon_bench::folds::poses::FoldPose;
use tryon_bench::folds::{FoldsBench, GARMENTS};
use tryon_bench::people::PeoplePlan;
use tryon_bench::tracking_plan::TrackingPlan;
use tryon_bench::worn::WornMotion;

/// Run time against error, methods side by side: tables as Markdown and JSON.
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
    /// Tracking of recorded and synthetic sequences under settings side by side.
    Tracking(TrackingArgs),
    /// Cloth on the standard scenes, by the live step or the offline solver.
    Cloth(ClothArgs),
    /// An outfit on a dancing body without a template: time, stretch, penetration.
    Dance(DanceArgs),
    /// Sleeping cloth on a body that stands, waves, lifts an arm or walks off.
    Standing(StandingArgs),
    /// Outfits worn through motions: crossings of cloth with cloth, speed at rest, stretch, time.
    Worn(WornArgs),
    /// Folds of drawn garments against the offline solver's in the same pose: energy, direction, places.
    Folds(FoldsArgs),
    /// The composed picture: borders against truth, shimmer, grain and edges against the photo, own clothes left.
    Picture(PictureArgs),
    /// Dress bodies and draw each outfit from several sides.
    Turntable(TurntableArgs),
    /// Tracking of everyone who walks in: people, postures and sides from nothing, stills and recordings.
    People(PeopleArgs),
    /// Garment capture on dressed scans with truth: labels, boundaries, surfaces, the body below, other bodies.
    Clothcap(ClothcapArgs),
    /// Query sets of continuous collision detection with truth: missed impacts, false alarms, time a query.
    Ccd(CcdArgs),
    /// Make the embedded body: the same bytes each time.
    MakeBody(MakeBodyArgs),
    /// Score the network of body parts on synthetic people and on recordings.
    ScoreParts(ScorePartsArgs),
    /// Render the synthetic people from which `tools/part_network` trains: one record a picture.
    RenderPeople(RenderPeopleArgs),
}

#[derive(Debug, Args)]
pub(crate) struct RenderPeopleArgs {
    /// File to write; its layout is that of `tryon::synth::labelled::LabelledFrames::write_crops`.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// People; each is seen in four poses.
    #[arg(long, default_value_t = 20_000, value_name = "N")]
    pub(crate) people: u64,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(crate) seed: u64,
    /// Worker threads; 0 means one per core.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(crate) threads: usize,
}

#[derive(Debug, Args)]
pub(crate) struct ClothcapArgs {
    /// Folder for clothcap.md and clothcap.json.
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
    #[command(flatten)]
    pub(crate) plan: PeoplePlan,
}

#[derive(Debug, Args)]
pub(crate) struct ClothArgs {
    /// Folder for cloth.md and cloth.json.
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
    /// The offline solver instead: time schemes, linear solvers, steps, resolutions (cloth-offline.md …).
    #[arg(long)]
    pub(crate) offline: bool,
    /// Most frames of a scene (with --offline).
    #[arg(long, value_name = "N", requires = "offline")]
    pub(crate) frames: Option<usize>,
    /// The sewn dress on the dancing body of this folder instead of scenes (dress-offline.md …, with --offline).
    #[arg(long, value_name = "DIR", requires = "offline", conflicts_with_all = ["scene", "full"])]
    pub(crate) dress: Option<PathBuf>,
    /// Threads, 0 for all cores (with --offline).
    #[arg(long, value_name = "N", default_value_t = 0, requires = "offline")]
    pub(crate) threads: usize,
}

#[derive(Debug, Args)]
pub(crate) struct OutfitArgs {
    /// Folder for the table as Markdown and JSON.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Garments of the library, innermost first.
    #[arg(long, value_name = "A+B", default_value = "tshirt+skirt")]
    garment: String,
    /// Edge length of the triangles (m).
    #[arg(long, value_name = "M", default_value_t = 0.0118)]
    edge: f64,
    /// Settings of the simulation as JSON, for example `{"most_steps":1000}`.
    #[arg(long, value_name = "JSON", default_value = "{}")]
    set: String,
    /// Worker threads.
    #[arg(long, value_name = "N", default_value_t = 2)]
    pub(crate) threads: usize,
}

impl OutfitArgs {
    /// Garments and the solver that simulates them.
    pub(crate) fn outfit(&self) -> anyhow::Result<OutfitSpec> {
        Ok(OutfitSpec {
            garments: self.garment.split('+').map(str::to_owned).collect(),
            edge: self.edge,
            config: serde_json::from_str(&self.set)?,
        })
    }
}

#[derive(Debug, Args)]
pub(crate) struct DanceArgs {
    #[command(flatten)]
    pub(crate) worn: OutfitArgs,
    /// Folder of the dance.
    #[arg(
        long,
        value_name = "DIR",
        default_value = "../shared/data/garments/cipc_apache2"
    )]
    pub(crate) data: PathBuf,
    /// Length of the dance (s).
    #[arg(long, value_name = "S", default_value_t = 4.8)]
    pub(crate) seconds: f64,
}

#[derive(Debug, Args)]
pub(crate) struct StandingArgs {
    #[command(flatten)]
    pub(crate) worn: OutfitArgs,
    /// Steps of 1/30 s in each motion.
    #[arg(long, value_name = "N", default_value_t = 60)]
    pub(crate) steps: usize,
    /// Angle of straight arms below the horizontal (degrees): 75 hang; without it they are off the trunk.
    #[arg(long, value_name = "A")]
    pub(crate) arms: Option<f64>,
}

#[derive(Debug, Args)]
pub(crate) struct WornArgs {
    /// Folder for worn.md and worn.json.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Garments of the library worn together, innermost first; without any, each of the library.
    #[arg(long, value_name = "A+B", value_delimiter = ',')]
    pub(crate) garment: Vec<String>,
    /// Motions.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "standing,calm,charleston,jacks"
    )]
    pub(crate) motion: Vec<WornMotion>,
    /// Edge length of the triangles (m), as worn without it.
    #[arg(long, value_name = "M")]
    pub(crate) edge: Option<f64>,
    /// Writes the cloth of every Nth picture below --out, for judges made by others: meshes/*.obj, and meshes/crossings.json.
    #[arg(long, value_name = "N")]
    pub(crate) meshes: Option<NonZeroUsize>,
    /// Settings of the simulation as JSON; by default those of a tracked body.
    #[arg(long, value_name = "JSON", default_value = r#"{"steady":0.008}"#)]
    pub(crate) set: String,
    /// Worker threads.
    #[arg(long, value_name = "N", default_value_t = 2)]
    pub(crate) threads: usize,
    /// Folder of the shared data.
    #[arg(long, value_name = "DIR", default_value = "../shared/data")]
    pub(crate) data: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct FoldsArgs {
    /// Folder for folds.md and folds.json.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Garments of the library; without any: T-shirt, hooded top, flared skirt, trousers.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) garment: Vec<String>,
    /// Poses; without any, all.
    #[arg(long, value_delimiter = ',')]
    pub(crate) pose: Vec<FoldPose>,
    /// Vertices of the offline solver's mesh, about.
    #[arg(long, value_name = "N", default_value_t = 30_000)]
    pub(crate) vertices: usize,
    /// Two garments in three poses against 12,000 vertices.
    #[arg(long, conflicts_with_all = ["garment", "pose", "vertices"])]
    pub(crate) quick: bool,
    /// Folder of the offline solver's meshes at rest: read if they are there, written otherwise.
    #[arg(long, value_name = "DIR")]
    pub(crate) truth: Option<PathBuf>,
    /// Worker threads; 0 means one per core.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) threads: usize,
}

impl FoldsArgs {
    /// Extent of the comparison.
    pub(crate) fn bench(&self) -> FoldsBench {
        let names = |all: &[&str]| all.iter().map(|n| (*n).to_owned()).collect();
        let truth = self.truth.clone();
        if self.quick {
            return FoldsBench {
                garments: names(&["tshirt", "skirt"]),
                poses: vec![FoldPose::Rest, FoldPose::Forward, FoldPose::Twisted],
                vertices: 12_000,
                truth,
            };
        }
        FoldsBench {
            garments: match &self.garment[..] {
                [] => names(&GARMENTS),
                some => some.to_vec(),
            },
            poses: match &self.pose[..] {
                [] => FoldPose::ALL.to_vec(),
                some => some.to_vec(),
            },
            vertices: self.vertices,
            truth,
        }
    }
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tryon-bench picture --out DIR
  tryon-bench picture --out DIR --only visibility,shimmer --quick
  tryon-bench picture --out DIR --only 'own coat' --data ../shared/data")]
pub(crate) struct PictureArgs {
    /// Folder for picture.md and picture.json, and one PNG a row to look at.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Only rows whose name contains one of these: visibility, shimmer, match, own, a source or a garment.
    #[arg(long, value_name = "TEXT", value_delimiter = ',')]
    pub(crate) only: Vec<String>,
    /// Fewer pictures of each row.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Folder of the shared data; without its recordings their rows are left out.
    #[arg(long, value_name = "DIR", default_value = "../shared/data")]
    pub(crate) data: PathBuf,
    /// Worker threads; 0 means one per core.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) threads: usize,
}

#[derive(Debug, Args)]
pub(crate) struct TurntableArgs {
    /// Folder for one PNG an outfit.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Garments worn together: names of the library, patterns (.json) or meshes (.obj, .glb, .mhclo); without any, each of the
    /// library.
    #[arg(long, value_name = "A+B")]
    pub(crate) garment: Vec<String>,
    /// Body that the mesh garments were made on (.npz, .obj).
    #[arg(long, value_name = "FILE")]
    pub(crate) garment_body: Option<PathBuf>,
    /// Bodies, a row each: named shapes, files (.npz), or recordings whose person is tracked.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "slim_woman,average,heavy_man"
    )]
    pub(crate) body: Vec<String>,
    /// Sizes, a block of columns each; `auto` is the suggested one.
    #[arg(long, value_delimiter = ',', default_value = "auto")]
    pub(crate) size: Vec<String>,
    /// Pose and motion of a body that is no recording.
    #[arg(long, default_value = "down")]
    pub(crate) pose: TurntablePose,
    /// Length of the motion (s).
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    pub(crate) seconds: f64,
    /// Edge length of the triangles (m).
    #[arg(long, value_name = "M")]
    pub(crate) edge: Option<f64>,
    /// Paint and print the fit.
    #[arg(long)]
    pub(crate) fit: bool,
    /// Sizes that do not fit too.
    #[arg(long)]
    pub(crate) any_size: bool,
    /// Paint edges through triangles of the same garment.
    #[arg(long)]
    pub(crate) crossings: bool,
    /// Without contact of cloth with itself.
    #[arg(long)]
    pub(crate) no_folds: bool,
}

/// Pose of a body of the turntable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum TurntablePose {
    /// Arms hanging.
    Down,
    /// Arms as in the rest pose.
    Rest,
    /// Walking on the spot, arms hanging.
    Walk,
}

#[derive(Debug, Args)]
pub(crate) struct TrackingArgs {
    /// Folder for tracking.md and tracking.json.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) plan: TrackingPlan,
}

#[derive(Debug, Args)]
pub(crate) struct ScorePartsArgs {
    /// Network by `tools/part_network/train.py`; without it the embedded one.
    #[arg(long, value_name = "FILE")]
    pub(crate) network: Option<PathBuf>,
    /// Synthetic images.
    #[arg(long, default_value_t = 1200, value_name = "N")]
    pub(crate) images: usize,
    /// Folder with `itop_stills` and `msr_action3d`, scored as well.
    #[arg(long, value_name = "DIR")]
    pub(crate) recordings: Option<PathBuf>,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(crate) seed: u64,
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
