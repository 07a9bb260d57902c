//! `tryon camera`: the cameras of this machine, their pictures, their places and their calibration.

mod calibrate;
mod check;
mod frames;
mod list;
mod view;

use crate::args::{CameraArgs, CameraWhat};
use anyhow::Result;
use std::process::ExitCode;

/// Runs the command.
///
/// # Errors
/// A source that cannot be opened or read, a recording that does not determine a calibration, a file that cannot be written.
pub(crate) fn run(args: &CameraArgs) -> Result<ExitCode> {
    match &args.what {
        CameraWhat::List(a) => list::run(a),
        CameraWhat::View(a) => view::run(a),
        CameraWhat::Check(a) => check::run(a),
        CameraWhat::Calibrate(a) => calibrate::run(a),
    }
}
