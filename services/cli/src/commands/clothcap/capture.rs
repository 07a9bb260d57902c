//! `tryon clothcap capture`: garments and the body under them, from scans or from one camera.

use super::scans::{Scans, label_config};
use super::turn;
use crate::args::{ClothcapCaptureArgs, ScanArgs};
use crate::input;
use anyhow::{Context, Result, ensure};
use serde_json::json;
use std::path::Path;
use std::time::Instant;
use tryon::clothcap::archive::{CaptureArchive, CaptureHeader, FrameDisplacements, FrameRecord};
use tryon::clothcap::picture::stages;
use tryon::clothcap::scan::BodyScan;
use tryon::clothcap::{CaptureConfig, FrameCapture, OutfitCapture};
use tryon::formats::image::write_png_rgb;
use tryon::par::with_threads;

/// Runs the command.
pub(super) fn run(args: &ClothcapCaptureArgs) -> Result<()> {
    input::create_dir(&args.out.join(PICTURES))?;
    with_threads(args.frame.threads, || capture_all(args))?
}

/// Folder of the stages' pictures.
const PICTURES: &str = "pictures";

fn capture_all(args: &ClothcapCaptureArgs) -> Result<()> {
    let config = CaptureConfig {
        labels: label_config(args.prior.as_deref())?,
        ..CaptureConfig::default()
    };
    let archive = CaptureArchive::new(&args.out)?;
    let header = archive.header(&input::template(args.frame.body.as_deref())?)?;
    let mut scans = opened(args, header.as_ref())?;
    let names: Vec<String> = scans.files.iter().map(|f| Scans::name(f)).collect();
    if let Some(h) = &header {
        ensure!(
            h.scans == names,
            "{} holds the capture of other scans",
            args.out.display()
        );
    }
    let mut job = CaptureJob::new(config, archive, header, &mut scans)?;
    let bar = input::progress(Some(names.len() as u64), "capturing");
    let mut rows = Vec::new();
    for (file, name) in scans.files.iter().zip(&names) {
        let started = Instant::now();
        let report = job
            .scan(&scans, file, (name, &names), &args.out)
            .with_context(|| format!("{}", file.display()))?;
        rows.push(json!({
            "scan": name,
            "report": report,
            "ms": started.elapsed().as_secs_f64() * 1e3,
        }));
        bar.inc(1);
    }
    bar.finish_and_clear();
    scans.write_report(&rows, &args.out)?;
    if let Some(report) = &scans.turn {
        turn::print_unseen(report);
    }
    println!("{} scans captured, in {}", names.len(), args.out.display());
    Ok(())
}

/// Scans of the command, or the one that is fused from its recording.
fn opened(args: &ClothcapCaptureArgs, header: Option<&CaptureHeader>) -> Result<Scans> {
    let scans = match (&args.input, &args.scans) {
        (Some(recording), _) => return turn::fused(recording, &args.frame, &args.out),
        (None, scans) => scans.clone().context("neither --scans nor --input")?,
    };
    let scans = ScanArgs {
        scans,
        frame: args.frame.clone(),
    };
    match header {
        Some(h) => Scans::reopen(&scans, h.frame),
        None => Scans::open(&scans),
    }
}

/// Capture that continues where a stopped one ended.
struct CaptureJob {
    archive: CaptureArchive,
    config: CaptureConfig,
    header: Option<CaptureHeader>,
    /// Absent until the first scan that is not done.
    capture: Option<OutfitCapture>,
    /// Last scan that was done before.
    last: Option<FrameRecord>,
    start: Option<tryon::clothcap::align::Start>,
}

impl CaptureJob {
    fn new(
        config: CaptureConfig,
        archive: CaptureArchive,
        header: Option<CaptureHeader>,
        scans: &mut Scans,
    ) -> Result<Self> {
        Ok(Self {
            archive,
            config,
            header,
            capture: None,
            last: None,
            start: scans.start.take(),
        })
    }

    /// Captures one scan unless it is done; its report.
    fn scan(
        &mut self,
        scans: &Scans,
        file: &Path,
        (name, names): (&str, &[String]),
        out: &Path,
    ) -> Result<serde_json::Value> {
        if let Some(record) = self
            .archive
            .record(name, &scans.template)?
            .filter(|_| self.header.is_some())
        {
            let report = serde_json::to_value(&record.report)?;
            self.last = Some(record);
            return Ok(report);
        }
        let scan = scans.read(file)?;
        if self.capture.is_none() {
            self.capture = Some(self.begin(scans)?);
        }
        let capture = self.capture.as_mut().context("no capture")?;
        let frame = capture.frame(&scan)?;
        if self.header.is_none() {
            let (outfit, clothed) = (capture.outfit(), capture.clothed());
            let header = CaptureHeader {
                version: 0,
                template: scans.template.name().to_owned(),
                frame: scans.frame,
                outfit: outfit.context("no outfit")?.clone(),
                clothed: clothed.context("no clothed template")?.clone(),
                scans: names.to_vec(),
            };
            self.archive.write_header(&header)?;
            self.header = Some(header);
        }
        self.write(scans, &scan, (name, &frame), out)?;
        Ok(serde_json::to_value(&frame.report)?)
    }

    fn begin(&mut self, scans: &Scans) -> Result<OutfitCapture> {
        let template = scans.template.clone();
        let config = self.config.clone();
        let Some(header) = &self.header else {
            let mut capture = OutfitCapture::new(template, config)?;
            if let Some(start) = self.start.take() {
                capture.start_at(start);
            }
            return Ok(capture);
        };
        let last = self.last.as_ref().map(|r| r.body.clone());
        let clothed = header.clothed.clone();
        let last = last.unwrap_or_else(|| clothed.body.clone());
        Ok(OutfitCapture::resume(
            template,
            config,
            header.outfit.clone(),
            (clothed, last),
        )?)
    }

    fn write(
        &self,
        scans: &Scans,
        scan: &BodyScan,
        (name, frame): (&str, &FrameCapture),
        out: &Path,
    ) -> Result<()> {
        let header = self.header.as_ref().context("no header")?;
        let capture = self.capture.as_ref().context("no capture")?;
        let picture = stages(capture.cloth(), scan, frame, &header.outfit);
        write_png_rgb(&out.join(PICTURES).join(format!("{name}.png")), &picture)?;
        let record = FrameRecord {
            scan: name.to_owned(),
            body: frame.undressed.body.clone(),
            report: frame.report.clone(),
        };
        let displacements = FrameDisplacements::of(&scans.template, frame);
        Ok(self.archive.write_frame(&record, &displacements)?)
    }
}
