//! Scans of a command: files, unit and axes, person of the first one, garments given by name.

use crate::args::ScanArgs;
use crate::{input, report};
use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tryon::body::{BodyShape, Template};
use tryon::clothcap::align::{Start, find_frame, find_person};
use tryon::clothcap::scan::{BodyScan, ScanFrame};
use tryon::clothcap::segment::{LabelConfig, Slot};
use tryon::clothcap::turn::TurnReport;
use tryon::clothcap::{CaptureError, minimal_shape};
use tryon::formats::scan::{ScanMesh, read_scan, scan_files};

/// Scans of one subject and the frame they share.
pub(super) struct Scans {
    /// Body template.
    pub(super) template: Arc<Template>,
    /// Files, in order.
    pub(super) files: Vec<PathBuf>,
    /// Unit and axes.
    pub(super) frame: ScanFrame,
    /// Person of the first scan.
    pub(super) start: Option<Start>,
    /// Report of the turn that the scan is fused from.
    pub(super) turn: Option<TurnReport>,
}

impl Scans {
    /// Lists the scans and finds unit, up axis and person of the first one, as far as they are not given.
    pub(super) fn open(args: &ScanArgs) -> Result<Self> {
        let template = input::template(&args.frame.body)?;
        let files = scan_files(&args.scans)?;
        let first = &files[0];
        let file = read_scan(first)?;
        let (frame, start) =
            found(args, &template, &file).with_context(|| format!("{}", first.display()))?;
        Ok(Self {
            template,
            files,
            frame,
            start: Some(start),
            turn: None,
        })
    }

    /// The same with a frame known from before; nothing is searched.
    pub(super) fn reopen(args: &ScanArgs, frame: ScanFrame) -> Result<Self> {
        Ok(Self {
            template: input::template(&args.frame.body)?,
            files: scan_files(&args.scans)?,
            frame,
            start: None,
            turn: None,
        })
    }

    /// Reads a scan.
    pub(super) fn read(&self, file: &Path) -> Result<BodyScan> {
        let mesh = read_scan(file)?;
        BodyScan::new(&mesh, &self.frame).with_context(|| format!("{}", file.display()))
    }

    /// Shape of the subject from a scan in minimal clothing, of any unit and axes.
    pub(super) fn minimal_shape(&self, file: &Path) -> Result<BodyShape> {
        let context = || format!("{}", file.display());
        let mesh = read_scan(file)?;
        let (frame, start) = find_frame(&self.template, &mesh).with_context(context)?;
        let scan = BodyScan::new(&mesh, &frame).with_context(context)?;
        minimal_shape(&self.template, &scan, &start.body).with_context(context)
    }

    /// Writes report.json with a row a scan.
    pub(super) fn write_report(&self, rows: &[Value], out: &Path) -> Result<()> {
        let report = json!({
            "template": self.template.name(),
            "frame": self.frame,
            "scans": rows,
            "turn": self.turn,
            "peak_memory_bytes": report::peak_memory(),
        });
        report::write(&out.join("report.json"), &report)
    }

    /// Names of all scans in results.
    pub(super) fn names(&self) -> Vec<String> {
        self.files.iter().map(|f| Self::name(f)).collect()
    }

    /// Name of a scan in results.
    pub(super) fn name(file: &Path) -> String {
        let stem = file.file_stem().map(|s| s.to_string_lossy().into_owned());
        stem.unwrap_or_else(|| "scan".into())
    }
}

fn found(
    args: &ScanArgs,
    template: &Arc<Template>,
    file: &ScanMesh,
) -> Result<(ScanFrame, Start), CaptureError> {
    let Some(metres_per_unit) = args.frame.unit else {
        return find_frame(template, file);
    };
    let frame = ScanFrame {
        metres_per_unit,
        up: args.frame.up.vector(),
        floor: None,
    };
    let frame = frame.with_floor(&file.points);
    let scan = BodyScan::new(file, &frame)?;
    Ok((frame, find_person(template, &scan)?))
}

/// Garments of `--prior`: slots by name, or a JSON file with them.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PriorFile {
    garments: Vec<Slot>,
}

/// Segmentation with the garments of `--prior`; without it they are found.
pub(super) fn label_config(prior: Option<&str>) -> Result<LabelConfig> {
    let Some(prior) = prior else {
        return Ok(LabelConfig::default());
    };
    let slots = if prior.ends_with(".json") {
        let text =
            std::fs::read_to_string(prior).with_context(|| format!("cannot read {prior}"))?;
        let file: PriorFile =
            serde_json::from_str(&text).with_context(|| format!("{prior} is no prior"))?;
        file.garments
    } else {
        let slot = |name: &str| -> Result<Slot> {
            let value = serde_json::Value::String(name.trim().to_owned());
            serde_json::from_value(value).with_context(|| {
                format!("--prior: `{name}`: expected top, under, bottom, one_piece or shoes")
            })
        };
        prior.split(',').map(slot).collect::<Result<_>>()?
    };
    ensure!(
        slots.iter().any(|s| s.is_garment()),
        "--prior names no garment"
    );
    Ok(LabelConfig {
        slots: Some(slots),
        ..LabelConfig::default()
    })
}
