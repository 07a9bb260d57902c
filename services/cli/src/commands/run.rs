//! `tryon run`: a recording to composited pictures.

use crate::args::RunArgs;
use crate::chain::{Chain, Choice};
use crate::input;
use crate::report::{Samples, Summary, peak_memory, write};
use anyhow::{Context, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;
use tryon::camera::{ColorImage, RgbdFrame};
use tryon::formats::image::write_png_rgb;
use tryon::formats::{RgbdSource, open_recording};
use tryon::mesh::{Topology, vertex_normals};
use tryon::par::{Par, with_threads};
use tryon::raster::{View, VisibilityBuffer, rasterise};

/// Time between the repetitions of a still picture, nanoseconds: 30 a second.
const STILL_INTERVAL_NS: u64 = 33_333_333;

/// report.json of this command.
#[derive(Debug, Default, Serialize)]
struct Report {
    frames: usize,
    pictures: usize,
    dressed_frames: usize,
    bad_frames: Vec<String>,
    sizes: Vec<String>,
    stages_ms: BTreeMap<String, Summary>,
    skipped: BTreeMap<String, Summary>,
    residual_mm: Summary,
    penetration_mm: Summary,
    peak_memory_bytes: Option<u64>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, named; or pictures that cannot be written.
pub(crate) fn run(args: &RunArgs) -> Result<ExitCode> {
    let choices = Choice::parse(
        &args.garments,
        args.size.as_deref(),
        args.garment_body.as_deref(),
    )?;
    let source = open_recording(&args.input)?;
    let template = input::template(args.body.as_deref())?;
    input::create_dir(&args.out)?;
    let chain = Chain::new(template, source.calibration(), choices);
    let report = with_threads(args.threads, || dress_all(args, source, chain))??;
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
    if report.dressed_frames == 0 {
        eprintln!(
            "tryon: nobody was dressed: no person was tracked in {}",
            args.input.display()
        );
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}

fn dress_all(args: &RunArgs, mut source: Box<dyn RgbdSource>, mut chain: Chain) -> Result<Report> {
    let calibration = source.calibration().clone();
    let total = source
        .len()
        .map(|n| n.min(args.frames.unwrap_or(usize::MAX)));
    let still = total == Some(1);
    let bar = input::progress(
        total.map(|n| if still { args.still_frames } else { n } as u64),
        "dressing",
    );
    let (mut stages, mut skipped) = (Samples::default(), Samples::default());
    let (mut residual, mut penetration) = (Vec::new(), Vec::new());
    let mut report = Report::default();
    let mut index = 0;
    while args.frames.is_none_or(|n| index < n) {
        let frame = match source.next_frame() {
            Ok(Some(frame)) => frame,
            Ok(None) => break,
            Err(e) => {
                // The recording goes on behind a bad frame; it is named, not hidden.
                eprintln!("tryon: frame {index} is left out: {e}");
                report.bad_frames.push(e.to_string());
                index += 1;
                continue;
            }
        };
        let repeats = if still { args.still_frames.max(1) } else { 1 };
        let mut last = None;
        for k in 0..repeats as u64 {
            let frame = RgbdFrame {
                time_ns: frame.time_ns + k * STILL_INTERVAL_NS,
                sequence: frame.sequence + k,
                ..frame.clone()
            };
            let outcome = chain
                .frame(&frame)
                .with_context(|| format!("frame {index}"))?;
            stages.extend(outcome.stages.iter().copied());
            skipped.extend(outcome.skipped.iter().copied());
            residual.push(outcome.residual_mm);
            penetration.push(outcome.penetration * 1e3);
            report.dressed_frames += usize::from(outcome.dressed);
            bar.inc(1);
            last = Some(outcome.picture);
        }
        if let Some(picture) = last {
            write_png_rgb(&args.out.join(format!("frame_{index:06}.png")), &picture)?;
            report.pictures += 1;
            if args.overlay {
                overlay(
                    &args.out.join(format!("frame_{index:06}_body.png")),
                    &chain,
                    &frame,
                    &calibration,
                )?;
            }
        }
        report.frames += 1;
        index += 1;
    }
    bar.finish_and_clear();
    report.sizes = std::mem::take(&mut chain.notes);
    report.stages_ms = stages.summaries();
    report.skipped = skipped.summaries();
    report.residual_mm = Summary::of(&residual);
    report.penetration_mm = Summary::of(&penetration);
    report.peak_memory_bytes = peak_memory();
    Ok(report)
}

/// The tracked body, shaded by its normals, half transparent over the picture.
fn overlay(
    path: &Path,
    chain: &Chain,
    frame: &RgbdFrame,
    calibration: &tryon::camera::Calibration,
) -> Result<()> {
    let (vertices, template) = chain.body();
    let mesh = template.mesh();
    let topology = Topology::new(mesh)?;
    let mut normals = Vec::new();
    vertex_normals(
        Par::Rayon,
        &vertices,
        mesh.faces(),
        topology.vertex_faces(),
        &mut normals,
    );
    let camera = calibration.depth;
    let mut seen = VisibilityBuffer::default();
    rasterise(
        &View::Perspective { camera, near: 0.05 },
        &vertices,
        mesh.faces(),
        &mut seen,
    );
    let mut picture = match &frame.color {
        Some(c) if (c.width(), c.height()) == (camera.width, camera.height) => c.clone(),
        _ => depth_picture(frame),
    };
    for (i, &face) in seen
        .face
        .iter()
        .enumerate()
        .filter(|(_, f)| **f != VisibilityBuffer::NONE)
    {
        let n = mesh.faces()[face as usize]
            .iter()
            .fold(tryon::math::V3::zeros(), |s, &v| s + normals[v as usize]);
        let light = (-n.z / n.norm().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        for (c, tint) in [80.0, 200.0, 255.0].iter().enumerate() {
            let p = &mut picture.data_mut()[3 * i + c];
            *p = (0.5 * f32::from(*p) + 0.5 * tint * (0.3 + 0.7 * light)) as u8;
        }
    }
    Ok(write_png_rgb(path, &picture)?)
}

/// Depth as grey, near is bright; readings missing are black.
fn depth_picture(frame: &RgbdFrame) -> ColorImage {
    const FARTHEST_MM: f32 = 5000.0;
    let mut out = ColorImage::filled(frame.depth.width(), frame.depth.height(), [0; 3]);
    for (p, &mm) in out.data_mut().chunks_exact_mut(3).zip(frame.depth.data()) {
        if mm > 0 {
            p.fill((255.0 * (1.0 - f32::from(mm) / FARTHEST_MM).clamp(0.05, 1.0)) as u8);
        }
    }
    out
}
