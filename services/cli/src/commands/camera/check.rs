//! `tryon camera check`: measurements of a camera, and findings about its place.

use super::frames::{Frames, ensure_frames};
use crate::args::CameraCheckArgs;
use crate::{findings, input};
use anyhow::Result;
use serde::Serialize;
use std::process::ExitCode;
use tryon::inspection::{
    Finding, FindingLimits, InspectionReport, InspectionSettings, Inspector, PersonSize, judge,
};

/// Result of a check as JSON.
#[derive(Debug, Serialize)]
struct CheckedCamera<'a> {
    source: &'a str,
    measured: &'a InspectionReport,
    findings: &'a [Finding],
}

/// Runs the command. Exit code 1 where something will fail.
///
/// # Errors
/// A source that cannot be opened or gives no frame.
pub(super) fn run(args: &CameraCheckArgs) -> Result<ExitCode> {
    let mut frames = Frames::open(&args.from, Some(args.seconds))?;
    let camera = frames.calibration().depth;
    let mut inspector = Inspector::new(frames.calibration(), InspectionSettings::default());
    let bar = input::progress(frames.len().map(|n| n as u64), "measuring");
    while let Some(next) = frames.next()? {
        inspector.add(&next.frame, next.arrival_ns);
        bar.inc(1);
    }
    bar.finish_and_clear();
    inspector.add_unreadable(frames.unreadable);

    let person = PersonSize::default();
    let report = inspector.report(args.sensor.model(), &person);
    let report = ensure_frames(&args.from.source, report)?;
    let found = judge(&report, &camera, &FindingLimits::default(), &person);
    if args.json {
        findings::print_json(&CheckedCamera {
            source: &args.from.source,
            measured: &report,
            findings: &found,
        })?;
    } else {
        findings::print(&found);
    }
    Ok(findings::exit_code(&found))
}
