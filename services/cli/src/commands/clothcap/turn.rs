//! Recording of one camera as a scan: tracked, fused, written to the output folder and found there again.

use super::scans::Scans;
use crate::args::ScanFrameArgs;
use crate::input;
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tryon::body::Template;
use tryon::clothcap::align::{AlignedBody, Start};
use tryon::clothcap::scan::ScanFrame;
use tryon::clothcap::turn::{FusedTurn, TurnConfig, TurnReport, TurnTracker, fuse};
use tryon::formats::open_recording;
use tryon::formats::scan::{PlyMesh, write_ply};

/// Fused scan in the output folder, and the person in it.
const SCAN: &str = "turn.ply";
/// See [`SCAN`].
const PERSON: &str = "turn.json";

/// Person of a fused scan, as written.
#[derive(Debug, Serialize, Deserialize)]
struct TurnFile {
    recording: PathBuf,
    template: String,
    body: AlignedBody,
    error: f64,
    report: TurnReport,
}

/// The scan fused from a recording; one that `out` holds already is used again.
///
/// # Errors
/// A recording that cannot be read or shows nobody, named; or an output folder that holds another one.
pub(super) fn fused(recording: &Path, args: &ScanFrameArgs, out: &Path) -> Result<Scans> {
    let template = input::template(args.body.as_deref())?;
    let (scan, person) = (out.join(SCAN), out.join(PERSON));
    if !person.exists() {
        let turn = fuse_recording(recording, &template)
            .with_context(|| format!("{}", recording.display()))?;
        write(recording, &template, &turn, [&scan, &person])?;
    }
    let text =
        std::fs::read(&person).with_context(|| format!("cannot read {}", person.display()))?;
    let file: TurnFile = serde_json::from_slice(&text)
        .with_context(|| format!("{} is no fused turn", person.display()))?;
    ensure!(
        file.recording == recording && file.template == template.name(),
        "{} holds the capture of another recording or body",
        out.display()
    );
    Ok(Scans {
        template,
        files: vec![scan],
        frame: ScanFrame::default(),
        start: Some(Start {
            body: file.body,
            error: file.error,
            compared: 1,
        }),
        turn: Some(file.report),
    })
}

fn fuse_recording(recording: &Path, template: &Arc<Template>) -> Result<FusedTurn> {
    let mut source = open_recording(recording)?;
    let bar = input::progress(source.len().map(|n| n as u64), "tracking");
    let mut tracker = TurnTracker::new(template.clone(), source.calibration().clone());
    while let Some(frame) = source.next_frame()? {
        tracker.step(&frame)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(fuse(template, &tracker.finish()?, &TurnConfig::default())?)
}

/// Writes the scan, then the person: a stopped write leaves no person.
fn write(
    recording: &Path,
    template: &Template,
    turn: &FusedTurn,
    [scan, person]: [&Path; 2],
) -> Result<()> {
    let mesh = PlyMesh {
        points: &turn.scan.points,
        normals: &turn.scan.normals,
        colors: &turn.scan.colors,
        ..PlyMesh::default()
    };
    write_ply(scan, &mesh)?;
    let file = TurnFile {
        recording: recording.to_owned(),
        template: template.name().to_owned(),
        body: turn.start.body.clone(),
        error: turn.start.error,
        report: turn.report.clone(),
    };
    crate::report::write(person, &file)
}

/// Prints what no frame showed.
pub(super) fn print_unseen(report: &TurnReport) {
    if !report.is_whole_turn {
        println!(
            "the subject turned by {:.0} of 360 degrees: sides that no frame shows are completed from the body",
            report.yaw_coverage_degrees
        );
    }
    if !report.unseen.is_empty() {
        let names: Vec<String> = report.unseen.iter().map(|r| r.to_string()).collect();
        println!("not seen, without garments: {}", names.join(", "));
    }
}
