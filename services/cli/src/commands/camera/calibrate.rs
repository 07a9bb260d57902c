//! `tryon camera calibrate`: pose and time of a colour camera, from somebody who walks.

use crate::args::CameraCalibrateArgs;
use anyhow::{Context, Result, bail};
use std::process::ExitCode;
use tryon::calibration::{Extrinsics, ExtrinsicsSettings, calibrate};
use tryon::geometry::camera::PictureTurn;

/// Runs the command.
///
/// # Errors
/// A recording that does not determine the calibration, in words; a file that cannot be written.
pub(crate) fn run(args: &CameraCalibrateArgs) -> Result<ExitCode> {
    if args.recording.mirrored || args.recording.turned != PictureTurn::default() {
        bail!(
            "a camera is calibrated as it delivers its pictures: leave out --turned and --mirrored"
        );
    }
    let mut source = args.recording.open(&args.input)?;
    let found = calibrate(source.as_mut(), &ExtrinsicsSettings::default())
        .with_context(|| args.input.display().to_string())?;

    let mut file = source.camera_file();
    file.lenses.color_from_depth = found.color_from_depth;
    file.color_time_offset_s += found.color_time_offset_s;
    file.write(&args.out)?;
    describe(&found);
    println!("written: {}", args.out.display());
    Ok(ExitCode::SUCCESS)
}

/// Prints the estimate with its standard deviations.
fn describe(found: &Extrinsics) {
    let iso = found.color_from_depth.iso();
    let (at, turn) = (
        iso.translation.vector * 1e3,
        iso.rotation.scaled_axis().map(f64::to_degrees),
    );
    let d = &found.deviations;
    let ([dx, dy, dz], [rx, ry, rz]) = (
        d.translation.map(|t| 1e3 * t),
        d.rotation.map(f64::to_degrees),
    );
    println!(
        "translation: {:.1} {:.1} {:.1} mm (± {dx:.1} {dy:.1} {dz:.1})",
        at.x, at.y, at.z
    );
    println!(
        "rotation: {:.2} {:.2} {:.2} degrees (± {rx:.2} {ry:.2} {rz:.2})",
        turn.x, turn.y, turn.z
    );
    println!(
        "colour was taken {:+.1} ms (± {:.1}) after its stamps",
        1e3 * found.color_time_offset_s,
        1e3 * d.time
    );
    println!(
        "{} frames compared, {} unreadable; residuals of {:.2} pixels, {:.0} % of the outline met",
        found.frames,
        found.unreadable,
        found.residual,
        100.0 * found.met
    );
}
