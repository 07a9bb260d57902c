//! `tryon clothcap capture`: garments and the body under them, from scans or from one camera.

use super::scans::{Scans, label_config};
use super::turn;
use crate::args::{ClothcapCaptureArgs, ScanArgs};
use crate::input;
use anyhow::{Context, Result, ensure};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tryon::clothcap::align::Start;
use tryon::clothcap::archive::{CaptureArchive, CaptureHeader, FrameDisplacements, FrameRecord};
use tryon::clothcap::picture::stages;
use tryon::clothcap::scan::BodyScan;
use tryon::clothcap::segment::BodyRegion;
use tryon::clothcap::{FrameCapture, FrameReport, OutfitCapture, OutfitCaptureConfig};
use tryon::formats::image::write_png_rgb;
use tryon::geometry::par::with_threads;

/// Runs the command.
pub(super) fn run(args: &ClothcapCaptureArgs) -> Result<()> {
    input::create_dir(&args.out.join(PICTURES))?;
    with_threads(args.frame.threads, || capture_all(args))?
}

/// Folder of the stages' pictures.
const PICTURES: &str = "pictures";

fn capture_all(args: &ClothcapCaptureArgs) -> Result<()> {
    let archive = CaptureArchive::new(&args.out)?;
    let header = archive.header(&input::template(&args.frame.body)?)?;
    let mut scans = opened(args, header.as_ref())?;
    if let Some(h) = &header {
        ensure!(
            h.scans == scans.names(),
            "{} holds the capture of other scans",
            args.out.display()
        );
    }
    let minimal = match (&args.minimal, &header) {
        (Some(file), None) => Some(scans.minimal_shape(file)?),
        _ => None,
    };
    let config = OutfitCaptureConfig {
        labels: label_config(args.prior.as_deref())?,
        without_skips: args.no_skip,
        minimal,
        ..OutfitCaptureConfig::default()
    };
    let count = scans.files.len();
    let mut job = CaptureJob {
        start: scans.start.take(),
        scans: &scans,
        out: &args.out,
        archive,
        config,
        header,
        capture: None,
        last: None,
        read: None,
    };
    let bar = input::progress(Some(count as u64), "capturing");
    let mut rows = Vec::new();
    let mut unseen = Vec::new();
    for (at, file) in scans.files.iter().enumerate() {
        let started = Instant::now();
        let done = job
            .scan(at)
            .with_context(|| format!("{}", file.display()))?;
        rows.push(json!({
            "scan": Scans::name(file),
            "report": done.report,
            "ms": started.elapsed().as_secs_f64() * 1e3,
        }));
        if done.was_done {
            // It says nothing of the time that the others take.
            bar.dec_length(1);
        } else {
            bar.inc(1);
        }
        unseen.extend(done.report.unseen);
    }
    bar.finish_and_clear();
    scans.write_report(&rows, &args.out)?;
    match &scans.turn {
        Some(report) => turn::print_unseen(report),
        None => print_unseen(&unseen, count),
    }
    println!("{count} scans captured, in {}", args.out.display());
    Ok(())
}

/// Prints the regions that no scan shows, from those that each of so many scans does not show.
fn print_unseen(regions: &[BodyRegion], scans: usize) {
    let is_in_none = |r: &BodyRegion| regions.iter().filter(|u| *u == r).count() == scans;
    let names = BodyRegion::ALL.into_iter().filter(is_in_none);
    let names: Vec<String> = names.map(|r| r.to_string()).collect();
    if !names.is_empty() {
        println!("not seen, without garments: {}", names.join(", "));
    }
}

/// Scans of the command, or the one that is fused from its recording.
fn opened(args: &ClothcapCaptureArgs, header: Option<&CaptureHeader>) -> Result<Scans> {
    let scans = match (&args.input, &args.scans) {
        (Some(recording), _) => return turn::fused(recording, args),
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

/// Result of one scan.
struct ScanDone {
    report: FrameReport,
    /// By a run before.
    was_done: bool,
}

/// Capture that continues where a stopped one ended.
struct CaptureJob<'a> {
    scans: &'a Scans,
    out: &'a Path,
    archive: CaptureArchive,
    config: OutfitCaptureConfig,
    header: Option<CaptureHeader>,
    /// Absent until the first scan that is not done.
    capture: Option<OutfitCapture>,
    /// Result of the scan before.
    last: Option<FrameRecord>,
    /// Scan before, if it was read.
    read: Option<BodyScan>,
    start: Option<Start>,
}

impl CaptureJob<'_> {
    /// Captures the scan of this number unless it is done.
    fn scan(&mut self, at: usize) -> Result<ScanDone> {
        let (scans, file) = (self.scans, &self.scans.files[at]);
        let name = &Scans::name(file);
        let before = self.archive.record(name, &scans.template)?;
        if let Some(record) = before.filter(|_| self.header.is_some()) {
            return Ok(self.done(record, None, true));
        }
        let scan = scans.read(file)?;
        if let Some(record) = self.repeated(at, &scan)? {
            return Ok(self.done(record, Some(scan), false));
        }
        if self.capture.is_none() {
            self.capture = Some(self.begin()?);
        }
        let capture = self.capture.as_mut().context("no capture")?;
        let frame = capture.frame(&scan)?;
        // Before the header, which names them.
        self.archive.write_textures(capture.textures())?;
        let header = match &self.header {
            Some(header) => header.clone(),
            None => header_of(capture, scans)?,
        };
        let record = self.write(name, &scan, &frame, &header)?;
        if self.header.is_none() {
            // After the first scan: a capture stopped before begins anew, since later scans are fitted in another way.
            self.archive.write_header(&header)?;
            self.header = Some(header);
        }
        Ok(self.done(record, Some(scan), false))
    }

    /// Keeps the result of a scan for the next one.
    fn done(&mut self, record: FrameRecord, read: Option<BodyScan>, was_done: bool) -> ScanDone {
        let report = record.report.clone();
        (self.last, self.read) = (Some(record), read);
        ScanDone { report, was_done }
    }

    /// Result of the scan before, for a scan that is unchanged. The first scan makes the outfit and is fitted in another way
    /// than those after it, so that the second one never repeats it.
    fn repeated(&mut self, at: usize, scan: &BodyScan) -> Result<Option<FrameRecord>> {
        let scans = self.scans;
        let name = &Scans::name(&scans.files[at]);
        let (Some(header), Some(before)) = (&self.header, &self.last) else {
            return Ok(None);
        };
        if at < 2 || self.config.without_skips {
            return Ok(None);
        }
        if self.read.is_none() {
            self.read = Some(scans.read(&scans.files[at - 1])?);
        }
        if !self.read.as_ref().is_some_and(|b| b.is_unchanged(scan)) {
            return Ok(None);
        }
        let from = self.picture(&before.scan);
        std::fs::copy(&from, self.picture(name)).with_context(|| format!("{}", from.display()))?;
        let record = self.archive.repeat(before, name, header, &scans.template)?;
        Ok(Some(record))
    }

    fn picture(&self, name: &str) -> PathBuf {
        self.out.join(PICTURES).join(format!("{name}.png"))
    }

    fn begin(&mut self) -> Result<OutfitCapture> {
        let scans = self.scans;
        let template = scans.template.clone();
        let config = self.config.clone();
        let Some(header) = &self.header else {
            let mut capture = OutfitCapture::new(template, config)?;
            if let Some(start) = self.start.take() {
                capture.start_at(start);
            }
            if self.config.minimal.is_none() {
                for file in shape_files(&scans.files) {
                    capture.add_shape_scan(scans.read(file)?);
                }
            }
            return Ok(capture);
        };
        let last = self.last.as_ref().map(|r| r.body.clone());
        let clothed = header.clothed.clone();
        let last = last.unwrap_or_else(|| clothed.body.clone());
        let textures = self.archive.textures(header)?;
        let outfit = header.outfit.clone();
        let capture = OutfitCapture::resume(template, config, outfit, clothed, last)?;
        Ok(capture.with_textures(textures))
    }

    fn write(
        &self,
        name: &str,
        scan: &BodyScan,
        frame: &FrameCapture,
        header: &CaptureHeader,
    ) -> Result<FrameRecord> {
        let capture = self.capture.as_ref().context("no capture")?;
        let textures = capture.textures();
        let picture = stages(capture.cloth(), scan, frame, &header.outfit, textures);
        write_png_rgb(&self.picture(name), &picture)?;
        let record = FrameRecord {
            scan: name.to_owned(),
            body: frame.undressed.body.clone(),
            report: frame.report.clone(),
        };
        let displacements = FrameDisplacements::of(&self.scans.template, frame);
        self.archive.write_frame(&record, &displacements)?;
        Ok(record)
    }
}

/// Header of a capture whose first scan is done.
fn header_of(capture: &OutfitCapture, scans: &Scans) -> Result<CaptureHeader> {
    let (outfit, clothed) = (capture.outfit(), capture.clothed());
    Ok(CaptureHeader {
        version: 0,
        template: scans.template.name().to_owned(),
        frame: scans.frame,
        outfit: outfit.context("no outfit")?.clone(),
        clothed: clothed.context("no clothed template")?.clone(),
        scans: scans.names(),
    })
}

/// Scans beside the first one that give the body under the clothes, evenly over the sequence.
fn shape_files(files: &[PathBuf]) -> impl Iterator<Item = &PathBuf> {
    /// Most of them; each costs about a second.
    const MOST: usize = 3;
    let count = MOST.min(files.len().saturating_sub(1));
    (1..=count).map(move |k| &files[k * (files.len() - 1) / count])
}
