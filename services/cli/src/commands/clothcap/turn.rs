//! Recording of one camera as a scan: tracked, fused, written to the output folder and found there again.

use super::scans::Scans;
use crate::args::ClothcapCaptureArgs;
use crate::input;
use crate::recording::RecordingArgs;
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tryon::body::Template;
use tryon::clothcap::align::{AlignedBody, Start};
use tryon::clothcap::scan::ScanFrame;
use tryon::clothcap::turn::{FusedTurn, TurnConfig, TurnReport, TurnTracker, fuse};
use tryon::formats::scan::{PlyMesh, write_ply};

/// Fused scan in the output folder, and the person in it.
const SCAN: &str = "turn.ply";
/// See [`SCAN`].
const PERSON: &str = "turn.json";

/// Person of a fused scan, as written.
#[derive(Debug, Serialize, Deserialize)]
struct TurnFile {
    recording: PathBuf,
    /// Choices for it, as their `Debug` writes them.
    #[serde(default)]
    options: String,
    template: String,
    body: AlignedBody,
    error: f64,
    report: TurnReport,
}

/// The scan fused from a recording; one that `out` holds already is used again.
///
/// # Errors
/// A recording that cannot be read or shows nobody, named; or an output folder that holds another one.
pub(super) fn fused(recording: &Path, args: &ClothcapCaptureArgs) -> Result<Scans> {
    let template = input::template(&args.frame.body)?;
    let (scan, person) = (args.out.join(SCAN), args.out.join(PERSON));
    let options = format!("{:?}", args.recording);
    if !person.exists() {
        let turn = fuse_recording(recording, &args.recording, &template)
            .with_context(|| format!("{}", recording.display()))?;
        write_scan(&scan, &turn)?;
        let file = TurnFile {
            recording: recording.to_owned(),
            options: options.clone(),
            template: template.name().to_owned(),
            body: turn.start.body,
            error: turn.start.error,
            report: turn.report,
        };
        // After the scan: a stopped write leaves no person.
        crate::report::write(&person, &file)?;
    }
    let text =
        std::fs::read(&person).with_context(|| format!("cannot read {}", person.display()))?;
    let file: TurnFile = serde_json::from_slice(&text)
        .with_context(|| format!("{} is no fused turn", person.display()))?;
    ensure!(
        file.recording == recording && file.options == options && file.template == template.name(),
        "{} holds the capture of another recording, of other options or another body",
        args.out.display()
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

fn fuse_recording(
    recording: &Path,
    options: &RecordingArgs,
    template: &Arc<Template>,
) -> Result<FusedTurn> {
    let mut source = options.open(recording)?;
    let bar = input::progress(source.len().map(|n| n as u64), "tracking");
    let mut tracker = TurnTracker::new(template.clone(), source.calibration().clone());
    while let Some(frame) = source.next_frame()? {
        tracker.step(&frame)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(fuse(template, &tracker.finish()?, &TurnConfig::default())?)
}

fn write_scan(path: &Path, turn: &FusedTurn) -> Result<()> {
    let mesh = PlyMesh {
        points: &turn.scan.points,
        normals: &turn.scan.normals,
        colors: &turn.scan.colors,
        ..PlyMesh::default()
    };
    Ok(write_ply(path, &mesh)?)
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
