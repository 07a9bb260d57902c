//! Arguments of `tryon camera`.

use crate::recording::RecordingArgs;
use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;
use tryon::inspection::SensorModel;

#[derive(Debug, Args)]
pub(crate) struct CameraArgs {
    #[command(subcommand)]
    pub(crate) what: CameraWhat,
}

#[derive(Debug, Subcommand)]
pub(crate) enum CameraWhat {
    /// List the cameras of this machine by family: serial numbers, names, modes, and what a family lacks here.
    List(CameraListArgs),
    /// Show a camera in the terminal, with its rate, holes and nearest surface, or write a picture of it.
    View(CameraViewArgs),
    /// Measure a camera and judge its place: rate, noise, holes, floor, light, room for a person.
    ///
    /// Exit code 1 where something will fail.
    Check(CameraCheckArgs),
    /// Estimate the pose and the time offset of the colour camera from a recording of somebody who walks before both.
    ///
    /// The lenses of both cameras are known, by the recording or by --camera, and the device stands still. Ten seconds: one
    /// person, to both sides of the picture, near and far. Frames without colour are left out.
    Calibrate(CameraCalibrateArgs),
}

/// Source of frames.
#[derive(Debug, Args)]
pub(crate) struct CameraSourceArgs {
    /// A camera of `tryon camera list` (`freenect`, `openni:SERIAL`), a recording, or `synth`.
    #[arg(value_name = "SOURCE")]
    pub(crate) source: String,
    #[command(flatten)]
    pub(crate) recording: RecordingArgs,
}

#[derive(Debug, Args)]
pub(crate) struct CameraListArgs {
    /// Print JSON instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct CameraViewArgs {
    #[command(flatten)]
    pub(crate) from: CameraSourceArgs,
    /// Time after which the command ends (s); without it, at the end of the recording or by Ctrl-C, and with --out after one
    /// second.
    #[arg(long, value_name = "S")]
    pub(crate) seconds: Option<f64>,
    /// Picture of the last frame to write: depth in colours (red near, blue far, black without reading) beside the colour
    /// image.
    #[arg(long, value_name = "PNG")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct CameraCheckArgs {
    #[command(flatten)]
    pub(crate) from: CameraSourceArgs,
    /// Length of the measurement (s).
    #[arg(long, value_name = "S", default_value_t = 5.0)]
    pub(crate) seconds: f64,
    /// Kind of sensor, whose noise the camera's is compared with.
    #[arg(long, value_enum, value_name = "KIND", default_value_t)]
    pub(crate) sensor: SensorKind,
    /// Print JSON instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Kinds of depth cameras.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub(crate) enum SensorKind {
    /// A projected pattern: Kinect v1, Xtion, Astra, RealSense D400.
    #[default]
    StructuredLight,
    /// Time of flight: Kinect v2, Azure Kinect, RealSense L515.
    TimeOfFlight,
}

impl SensorKind {
    /// Its noise model.
    pub(crate) fn model(self) -> SensorModel {
        match self {
            Self::StructuredLight => SensorModel::StructuredLight,
            Self::TimeOfFlight => SensorModel::TimeOfFlight,
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct CameraCalibrateArgs {
    /// A recording with depth and colour; its extrinsics, if it has any, are where the estimate starts.
    #[arg(value_name = "REC")]
    pub(crate) input: PathBuf,
    #[command(flatten)]
    pub(crate) recording: RecordingArgs,
    /// Calibration to write, for --camera or as camera.json of a folder.
    #[arg(long, value_name = "JSON")]
    pub(crate) out: PathBuf,
}
