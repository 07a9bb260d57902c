//! Commands and flags of the command line.

mod camera;
mod clothcap;
mod fine;
mod identity;
mod mesh_frame;
mod offline;
mod serve;
mod token;

pub(crate) use camera::{
    CameraArgs, CameraCalibrateArgs, CameraCheckArgs, CameraListArgs, CameraSourceArgs,
    CameraViewArgs, CameraWhat,
};
pub(crate) use clothcap::{
    ClothcapAlignArgs, ClothcapArgs, ClothcapCaptureArgs, ClothcapRetargetArgs,
    ClothcapSegmentArgs, ClothcapWhat, ScanArgs, Shard,
};
pub(crate) use fine::FineSessionArgs;
pub(crate) use identity::{IdentityArgs, IdentityIssueArgs, IdentityMakeArgs, IdentityWhat};
pub(crate) use mesh_frame::{BodyArgs, GarmentBodyArgs, MeshFrameArgs};
pub(crate) use offline::{FineArgs, SolverArgs};
pub(crate) use serve::{DemoArgs, UpArgs};
pub(crate) use token::{
    AudienceArg, ClaimArgs, TokenArgs, TokenEnrolArgs, TokenIssueArgs, TokenKeyArgs,
    TokenRedeemArgs, TokenRevokeArgs, TokenWhat,
};

use crate::input::GivenChoice;
use crate::recording::RecordingArgs;
use anyhow::Result;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use tryon::landmarks::Landmarker;

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
    /// Run the whole chain in this process on a display figure in a studio: nothing to install, no camera, no GPU.
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
    /// Garments from 3D scans of a person: align, segment, capture, and dress other bodies.
    Clothcap(ClothcapArgs),
    /// Check a body, garment or recording made elsewhere and convert it to this product's own form. A conversion of a
    /// recording that was stopped continues when it is started again.
    Import(ImportArgs),
    /// Write the embedded body or a garment to OBJ, glTF or JSON, or a recording to MCAP for Foxglove and rerun.
    Export(ExportArgs),
    /// Record a source (the synthetic person, a folder, or a running camera node) to MCAP or a folder.
    Record(RecordArgs),
    /// Publish a recording as if it were a live camera.
    Replay(ReplayArgs),
    /// Cameras: which there are, what one delivers, whether its place suits, where its colour camera is.
    Camera(CameraArgs),
    /// Keys, tokens and enrolment codes: who may call the services.
    Token(TokenArgs),
    /// The authority by which a store's services know each other, and certificates of it.
    Identity(IdentityArgs),
    /// Check this machine: cores, memory, graphics adapter, ports, cameras, shared data; report expected faults.
    Doctor(DoctorArgs),
}

#[derive(Debug, Args)]
pub(crate) struct ColorArgs {
    /// Tracks by colour as well, with the model that `tools/landmarks/convert` makes; without it by depth alone.
    #[arg(long, value_name = "FILE")]
    pub(crate) color_model: Option<PathBuf>,
}

impl ColorArgs {
    /// The networks of the model that was named.
    ///
    /// # Errors
    /// A file that is missing or not the model.
    pub(crate) fn landmarker(&self) -> Result<Option<Landmarker>> {
        Ok(self
            .color_model
            .as_ref()
            .map(Landmarker::open)
            .transpose()?)
    }
}

#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    /// A recording: an RGBD folder, .mcap, .bag, .db3 or a rosbag2 folder, Azure Kinect's .mkv, Record3D's .r3d, .npz,
    /// or one depth image (.png) with its colour beside it (depth_1.png: color_1.png, rgb_1.png or .jpg).
    #[arg(long, value_name = "REC")]
    pub(crate) input: PathBuf,
    #[command(flatten)]
    pub(crate) recording: RecordingArgs,
    /// Garments: names (see `tryon export --list`), pattern files (.json, ours or GarmentCode's), layered as they say, or
    /// meshes (.obj with or without stitches, .glb, .gltf, MakeHuman's .mhclo), or captures (the folder that `tryon
    /// clothcap capture` wrote for all its garments, FOLDER/top, FOLDER/under, FOLDER/bottom … for one).
    #[arg(long = "garment", value_name = "NAME|FILE|CAPTURE", required = true)]
    pub(crate) garments: Vec<String>,
    #[command(flatten)]
    pub(crate) garment_body: GarmentBodyArgs,
    #[command(flatten)]
    pub(crate) frame: MeshFrameArgs,
    /// Fabric of all garments instead of their own: a preset's name, a file measured as by Wang et al. 2011, or a material.
    #[arg(long, value_name = "NAME|FILE")]
    pub(crate) fabric: Option<String>,
    /// Size for all garments but pattern files and meshes on a guessed body; without it each is chosen from the tracked
    /// body.
    #[arg(long, value_name = "SIZE")]
    pub(crate) size: Option<String>,
    /// Folder for frame pictures, report.json and, by the offline solver, positions.npy (cloth), body.npy (both frames ×
    /// vertices × 3, f32) and outfit.glb of both.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) body: BodyArgs,
    #[command(flatten)]
    pub(crate) color: ColorArgs,
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

impl RunArgs {
    /// Choices for all garments.
    pub(crate) fn given(&self) -> GivenChoice<'_> {
        GivenChoice {
            size: self.size.as_deref(),
            body: self.garment_body.given(),
            frame: self.frame.stated(),
            fabric: self.fabric.as_deref(),
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct TrackArgs {
    /// A recording: an RGBD folder, .mcap, .bag, .db3 or a rosbag2 folder, Azure Kinect's .mkv, Record3D's .r3d, .npz,
    /// or one depth image (.png) with its colour beside it (depth_1.png: color_1.png, rgb_1.png or .jpg).
    #[arg(long, value_name = "REC")]
    pub(crate) input: PathBuf,
    #[command(flatten)]
    pub(crate) recording: RecordingArgs,
    #[command(flatten)]
    pub(crate) body: BodyArgs,
    #[command(flatten)]
    pub(crate) color: ColorArgs,
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
    /// Scene file: mesh, pinned vertices, colliders, material, duration; or a textile test: cantilever, cusick or
    /// picture-frame.
    #[arg(long, value_name = "SCENE.json|TEST")]
    pub(crate) scene: PathBuf,
    /// Fabric of a textile test: a preset's name, a file measured as by Wang et al. 2011, or a material.
    #[arg(long, value_name = "NAME|FILE", default_value = "cotton")]
    pub(crate) fabric: String,
    /// Edge length of a textile test (m).
    #[arg(long, value_name = "M", default_value_t = 0.005)]
    pub(crate) edge: f64,
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
    /// of ours or GarmentCode's .json), a measured fabric (.json), or a recording (.mcap, .bag, .db3, .mkv, .r3d, .npz or
    /// .png with depth, or a folder).
    #[arg(value_name = "FILE")]
    pub(crate) input: PathBuf,
    #[command(flatten)]
    pub(crate) recording: RecordingArgs,
    #[command(flatten)]
    pub(crate) frame: MeshFrameArgs,
    /// Checked copy to write (.obj or .glb for bodies and garments, .json for patterns, .mcap or a folder for
    /// recordings).
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// `body`, a garment name, or a recording.
    #[arg(value_name = "WHAT|REC", required_unless_present = "list")]
    pub(crate) what: Option<String>,
    #[command(flatten)]
    pub(crate) recording: RecordingArgs,
    /// .obj or .glb for meshes; .json for a garment's sewing pattern; .mcap for a recording.
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
    /// Source of the frames: `studio` (a display figure), `synth` (or `synth:leave`, `synth:walk`, `synth:still`, `synth:seated`, `synth:empty`), a recording to convert, or
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
pub(crate) struct DoctorArgs {
    /// Print JSON instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}
