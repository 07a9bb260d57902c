//! `tryon camera`: calibration of cameras.

mod calibrate;

use crate::args::{CameraArgs, CameraWhat};
use anyhow::Result;
use std::process::ExitCode;

/// Runs the command.
///
/// # Errors
/// A recording that cannot be read or does not determine the calibration, a file that cannot be written.
pub(crate) fn run(args: &CameraArgs) -> Result<ExitCode> {
    match &args.what {
        CameraWhat::Calibrate(a) => calibrate::run(a),
    }
}
