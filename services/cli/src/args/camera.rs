//! Arguments of `tryon camera`.

use crate::recording::RecordingArgs;
use clap::{Args, Subcommand};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct CameraArgs {
    #[command(subcommand)]
    pub(crate) what: CameraWhat,
}

#[derive(Debug, Subcommand)]
pub(crate) enum CameraWhat {
    /// Estimate the pose and the time offset of the colour camera from a recording of somebody who walks before both.
    ///
    /// The lenses of both cameras are known, by the recording or by --camera, and the device stands still. Ten seconds: one
    /// person, to both sides of the picture, near and far. Frames without colour are left out.
    Calibrate(CameraCalibrateArgs),
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
