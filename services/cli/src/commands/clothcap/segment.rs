//! `tryon clothcap segment`: garment labels of scans.

use super::scans::{Scans, label_config};
use crate::args::ClothcapSegmentArgs;
use crate::{input, report};
use anyhow::{Context, Result};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::Path;
use tryon::clothcap::ScanSegmenter;
use tryon::clothcap::multi::MultiCloth;
use tryon::clothcap::segment::Labelling;
use tryon::formats::scan::{PlyMesh, read_scan, write_ply};
use tryon::geometry::par::with_threads;

/// Runs the command.
pub(super) fn run(args: &ClothcapSegmentArgs) -> Result<()> {
    input::create_dir(&args.out)?;
    with_threads(args.scans.frame.threads, || segment_all(args))?
}

fn segment_all(args: &ClothcapSegmentArgs) -> Result<()> {
    let config = label_config(args.prior.as_deref())?;
    let mut scans = Scans::open(&args.scans)?;
    let mut segmenter = ScanSegmenter::new(scans.template.clone(), config)?;
    if let Some(start) = scans.start.take() {
        segmenter.start_at(start);
    }
    let (mut first, mut rows) = (None, Vec::new());
    let bar = input::progress(Some(scans.files.len() as u64), "segmenting");
    for file in &scans.files {
        let scan = scans.read(file)?;
        let segmented = segmenter
            .step(&scan)
            .with_context(|| format!("{}", file.display()))?;
        let labels = scan.rows(&segmented.parts(), 0);
        first.get_or_insert(segmented.labelling);
        write_labels(
            file,
            &labels,
            &args.out.join(format!("{}.ply", Scans::name(file))),
        )?;
        rows.push(json!({
            "scan": Scans::name(file),
            "points": scan.points.len(),
            "left_out": scan.left_out,
            "notes": scan.notes,
        }));
        bar.inc(1);
    }
    bar.finish_and_clear();
    scans.write_report(&rows, &args.out)?;
    let labelling = first.context("no scan was segmented")?;
    let cloth = MultiCloth::new(segmenter.cloth(), &labelling);
    let parts = parts(&labelling, &cloth);
    report::write(&args.out.join("labels.json"), &parts)?;
    println!(
        "{} scans, {} garments, in {}",
        scans.files.len(),
        cloth.parts.len(),
        args.out.display()
    );
    Ok(())
}

/// Copies a scan with a label a row; rows left out are skin.
pub(super) fn write_labels(file: &Path, labels: &[u8], out: &Path) -> Result<()> {
    let mesh = read_scan(file)?;
    let ply = PlyMesh {
        points: &mesh.points,
        faces: &mesh.faces,
        normals: &mesh.normals,
        colors: &mesh.colors,
        labels: Some(labels),
    };
    Ok(write_ply(out, &ply)?)
}

/// Names and boundaries by label.
fn parts(labelling: &Labelling, cloth: &MultiCloth) -> BTreeMap<String, serde_json::Value> {
    let ids = labelling.parts();
    let mut out = BTreeMap::from([(
        "0".to_owned(),
        json!({"name": "skin", "boundaries": Vec::<String>::new()}),
    )]);
    for part in &cloth.parts {
        let rings: Vec<&str> = part.rings.iter().map(|r| r.name.as_str()).collect();
        let id = ids[usize::from(part.label)];
        out.insert(
            id.to_string(),
            json!({"name": part.slot, "boundaries": rings}),
        );
    }
    out
}
