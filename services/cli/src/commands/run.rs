//! `tryon run`: a recording to composited pictures.

use crate::args::RunArgs;
use crate::input;
use crate::overlay::tinted;
use crate::preview::repetition;
use crate::report::{OffPersonSummary, Samples, Summary, peak_memory, write};
use anyhow::{Context, Result, ensure};
use serde::Serialize;
use std::collections::BTreeMap;
use std::process::ExitCode;
use tryon::cloth::BendingResolution;
use tryon::formats::RgbdSource;
use tryon::formats::image::write_png_rgb;
use tryon::geometry::par::with_threads;
use tryon::mirror::{Mirror, MirrorFrame};
use tryon::tracking::{LostReason, Status};

/// report.json of this command.
#[derive(Debug, Default, Serialize)]
struct Report {
    frames: usize,
    pictures: usize,
    dressed_frames: usize,
    /// Frames by the tracker's status.
    statuses: BTreeMap<&'static str, usize>,
    bad_frames: Vec<String>,
    sizes: Vec<String>,
    stages_ms: BTreeMap<String, Summary>,
    skipped: BTreeMap<String, Summary>,
    residual_mm: Summary,
    penetration_mm: Summary,
    /// Garments off the recorded person.
    off_person: OffPersonSummary,
    /// Bending that the mesh of each garment carries.
    bending: Vec<GarmentBending>,
    peak_memory_bytes: Option<u64>,
}

/// Bending that the mesh of a garment carries.
#[derive(Debug, Serialize)]
struct GarmentBending {
    /// Pieces of one file may share it.
    name: String,
    #[serde(flatten)]
    limit: BendingResolution,
}

/// Measurements of all frames.
#[derive(Debug, Default)]
struct Measured {
    stages_ms: Samples,
    skipped: Samples,
    residual_mm: Vec<f64>,
    penetration_mm: Vec<f64>,
    /// Frame and share of each measured picture.
    off_person: Vec<(usize, f32)>,
    dressed: usize,
    statuses: BTreeMap<&'static str, usize>,
}

impl Measured {
    fn add(&mut self, index: usize, seen: &MirrorFrame) {
        self.stages_ms.extend(seen.stages_ms.iter().copied());
        self.skipped.extend(skipped(seen));
        self.residual_mm.push(seen.tracking.residual_mm);
        let depth = seen.cloth.as_ref().map_or(0.0, |c| c.penetration_left);
        self.penetration_mm.push(depth * 1e3);
        let off_person = seen.render.off_person.map(|off| (index, off.share));
        self.off_person.extend(off_person);
        self.dressed += usize::from(seen.is_dressed);
        *self
            .statuses
            .entry(words(seen.tracking.status))
            .or_default() += 1;
    }

    fn into_report(self, report: Report) -> Report {
        Report {
            dressed_frames: self.dressed,
            statuses: self.statuses,
            stages_ms: self.stages_ms.summaries(),
            skipped: self.skipped.summaries(),
            residual_mm: Summary::of(&self.residual_mm),
            penetration_mm: Summary::of(&self.penetration_mm),
            off_person: OffPersonSummary::of(&self.off_person),
            peak_memory_bytes: peak_memory(),
            ..report
        }
    }
}

/// A tracker's status and the reason for it.
fn words(status: Status) -> &'static str {
    match status {
        Status::Searching => "searching for a person",
        Status::Calibrating => "tracking, measuring the size",
        Status::Tracking => "tracking",
        Status::Sitting => "sitting",
        Status::Lost { reason } => match reason {
            LostReason::NoPerson => "lost: nobody of a body's size",
            LostReason::Residual => "lost: the body explains too little of the picture",
            LostReason::Disagreement => "lost: the body contradicts the picture",
            LostReason::Thing => "lost: what was followed is no person",
            LostReason::NotFinite => "lost: the fit was not finite",
        },
    }
}

/// Why nobody was dressed: the frames by status.
fn reason(statuses: &BTreeMap<&'static str, usize>) -> String {
    let tally = statuses.iter().map(|(words, n)| format!("{words} in {n}"));
    tally.collect::<Vec<_>>().join("; ")
}

/// Work that a frame did not need, by the names of report.json.
fn skipped(seen: &MirrorFrame) -> impl Iterator<Item = (&'static str, f64)> {
    let (tracking, render) = (&seen.tracking.skipped, &seen.render);
    let counts = [
        ("hidden template points", Some(tracking.hidden_points)),
        ("pictures that show nothing new", Some(tracking.frames)),
        (
            "sleeping cloth vertices",
            seen.cloth.as_ref().map(|c| c.sleeping),
        ),
        ("picture tiles without garment", Some(render.tiles_skipped)),
        ("garment faces hidden by others", Some(render.faces_hidden)),
        ("garments hidden by others", Some(render.garments_hidden)),
        (
            "normals of unseen garment vertices",
            Some(render.normals_skipped),
        ),
        ("hands away from garments", Some(render.hands.skipped)),
    ];
    counts
        .into_iter()
        .filter_map(|(name, n)| Some((name, n? as f64)))
}

/// Runs the command.
///
/// # Errors
/// Bad input, named; or pictures that cannot be written.
pub(crate) fn run(args: &RunArgs) -> Result<ExitCode> {
    if args.solver.is_offline()? {
        return super::run_offline::run(args);
    }
    ensure!(args.fine.still.is_none(), "--still needs --solver offline");
    let choices = input::choices(&args.garments, &args.given())?;
    let source = args.recording.open(&args.input)?;
    let template = input::template(&args.body)?;
    input::create_dir(&args.out)?;
    let mut mirror = Mirror::new(template, source.calibration(), choices);
    if let Some(landmarker) = args.color.landmarker()? {
        mirror = mirror.with_landmarker(landmarker);
    }
    mirror.set_off_person_interval(0.0);
    let report = with_threads(args.threads, || dress_all(args, source, mirror))??;
    write(&args.out.join("report.json"), &report)?;
    for note in &report.sizes {
        println!("{note}");
    }
    println!(
        "{} frames, {} with garments, pictures and report.json in {}",
        report.frames,
        report.dressed_frames,
        args.out.display()
    );
    if report.off_person.above_2_percent > 0.0 {
        println!("{}", report.off_person);
    }
    if report.dressed_frames == 0 {
        eprintln!(
            "tryon: nobody was dressed in {}: {}",
            args.input.display(),
            reason(&report.statuses)
        );
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}

fn dress_all(
    args: &RunArgs,
    mut source: Box<dyn RgbdSource>,
    mut mirror: Mirror,
) -> Result<Report> {
    let calibration = source.calibration().clone();
    let total = source
        .len()
        .map(|n| n.min(args.frames.unwrap_or(usize::MAX)));
    let is_still = total == Some(1);
    let shown = total.map(|n| if is_still { args.still_frames } else { n } as u64);
    let bar = input::progress(shown, "dressing");
    let mut measured = Measured::default();
    let mut report = Report::default();
    let mut index = 0;
    while args.frames.is_none_or(|n| index < n) {
        let frame = match source.next_frame() {
            Ok(Some(frame)) => frame,
            Ok(None) => break,
            Err(e) => {
                // A bad frame is reported and the recording continues behind it.
                eprintln!("tryon: frame {index} is left out: {e}");
                report.bad_frames.push(e.to_string());
                index += 1;
                continue;
            }
        };

        let repeats = if is_still {
            args.still_frames.max(1)
        } else {
            1
        };
        let mut picture = None;
        for k in 0..repeats as u64 {
            let seen = mirror
                .step(&repetition(&frame, k))
                .with_context(|| format!("frame {index}"))?;
            measured.add(index, &seen);
            bar.inc(1);
            picture = Some(seen.picture);
        }

        if let Some(picture) = picture {
            write_png_rgb(&args.out.join(format!("frame_{index:06}.png")), &picture)?;
            report.pictures += 1;
        }
        if args.overlay {
            let path = args.out.join(format!("frame_{index:06}_body.png"));
            let mesh = mirror.template().mesh().clone();
            let picture = tinted(mirror.posed_body(), &mesh, &frame, &calibration)?;
            write_png_rgb(&path, &picture)?;
        }
        report.frames += 1;
        index += 1;
    }
    bar.finish_and_clear();
    report.sizes = mirror.notes().to_vec();
    let worn = mirror.outfit().map(|o| &o.model.outfit.garments);
    report.bending = (worn.into_iter().flatten())
        .map(|g| GarmentBending {
            name: g.name.clone(),
            limit: BendingResolution::of_garment(g).0,
        })
        .collect();
    Ok(measured.into_report(report))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_dressed_has_a_reason() {
        let [searching, sitting] = [Status::Searching, Status::Sitting].map(words);
        let alone = reason(&BTreeMap::from([(searching, 9)]));
        assert_eq!(alone, "searching for a person in 9");
        let seated = reason(&BTreeMap::from([(searching, 2), (sitting, 7)]));
        assert_eq!(seated, "searching for a person in 2; sitting in 7");
    }
}
