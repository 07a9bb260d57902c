//! `tryon clothcap`: garments from scans or one camera, onto any body.

mod align;
mod capture;
mod glb;
mod retarget;
mod scans;
mod segment;
mod turn;

use crate::args::{ClothcapArgs, ClothcapWhat};
use anyhow::Result;
use std::process::ExitCode;

/// Runs the command.
///
/// # Errors
/// Bad input, named; or results that cannot be written.
pub(crate) fn run(args: &ClothcapArgs) -> Result<ExitCode> {
    match &args.what {
        ClothcapWhat::Align(a) => align::run(a),
        ClothcapWhat::Segment(a) => segment::run(a),
        ClothcapWhat::Capture(a) => capture::run(a),
        ClothcapWhat::Retarget(a) => retarget::run(a),
    }?;
    Ok(ExitCode::SUCCESS)
}
