//! `tryon clothcap align`: single-mesh alignments of scans.

use super::scans::Scans;
use crate::args::ClothcapAlignArgs;
use crate::input;
use anyhow::{Context, Result};
use serde_json::json;
use std::time::Instant;
use tryon::clothcap::align::Aligner;
use tryon::clothcap::settings::AlignmentSettings;
use tryon::formats::scan::{PlyMesh, write_ply};
use tryon::geometry::par::with_threads;

/// Runs the command.
pub(super) fn run(args: &ClothcapAlignArgs) -> Result<()> {
    input::create_dir(&args.out)?;
    with_threads(args.scans.frame.threads, || align_all(args))?
}

fn align_all(args: &ClothcapAlignArgs) -> Result<()> {
    let mut scans = Scans::open(&args.scans)?;
    let mut aligner = Aligner::new(scans.template.clone(), AlignmentSettings::default())?;
    if let Some(start) = scans.start.take() {
        aligner.start_at(start);
    }
    let bar = input::progress(Some(scans.files.len() as u64), "aligning");
    let mut rows = Vec::new();
    for file in &scans.files {
        let started = Instant::now();
        let scan = scans.read(file)?;
        let name = Scans::name(file);
        let aligned = aligner
            .align(&scan)
            .with_context(|| format!("{}", file.display()))?;
        let mesh = PlyMesh {
            points: &aligned.surface,
            faces: aligner.cloth().template().mesh().faces(),
            ..PlyMesh::default()
        };
        write_ply(&args.out.join(format!("{name}.ply")), &mesh)?;
        rows.push(json!({
            "scan": name,
            "points": scan.points.len(),
            "left_out": scan.left_out,
            "notes": scan.notes,
            "alignment": aligned.report,
            "shape": aligned.body.shape,
            "ms": started.elapsed().as_secs_f64() * 1e3,
        }));
        bar.inc(1);
    }
    bar.finish_and_clear();
    scans.write_report(&rows, &args.out)?;
    println!("{} scans aligned, in {}", rows.len(), args.out.display());
    Ok(())
}
