//! `tryon run --solver offline`: the preview dresses the subject, the offline solver goes on from its result.

use super::export::SKIN;
use crate::args::RunArgs;
use crate::input;
use crate::interrupt::INTERRUPTED;
use crate::offline_files::{OfflineFiles, VertexCounts, saved_state};
use crate::preview::{Preview, PreviewFrame};
use crate::report::{GarmentPart, garment_parts, peak_memory, write};
use anyhow::{Context, Result, bail};
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use tryon::cloth::fine::{OfflineFrameReport, checkpoint_frame};
use tryon::formats::gltf::{GlbMesh, write_glb_motion};
use tryon::formats::image::write_png_rgb;
use tryon::geometry::camera::ColorImage;
use tryon::geometry::math::P3;
use tryon::geometry::par::{Par, with_threads};
use tryon::mirror::{
    DressedOutfit, FrameClock, MirrorError, NOMINAL_INTERVAL, OfflineDrapeReport, OfflineOutfit,
    OfflineRun, OutfitPainter, time_step,
};

/// Frames after the wanted one that are tried when its cloth intersects too much to start from: one second.
const LATER_STARTS: usize = 30;

/// report.json of an offline run.
#[derive(Debug, Default, Serialize)]
struct Report {
    garments: Vec<GarmentPart>,
    /// Frame of the recording that the simulation starts from.
    first_frame: usize,
    /// Frames of positions.npy and body.npy, the start included.
    frames: usize,
    /// Drape in the pose of the first frame, from coarse to fine.
    drape: OfflineDrapeReport,
    /// Frames without a live body: cloth stays as it was, and starts again from the preview.
    waited: Vec<usize>,
    /// Work of each frame of this run, and its time (s).
    work: Vec<(OfflineFrameReport, f64)>,
    sizes: Vec<String>,
    peak_memory_bytes: Option<u64>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, named; a start with intersections that cannot be repaired; a step that is not solved; results that cannot
/// be written.
pub(crate) fn run(args: &RunArgs) -> Result<ExitCode> {
    input::create_dir(&args.out)?;
    let mut preview = Preview::open(args)?;
    with_threads(args.threads, || {
        let Some(dressed) = dress(args, &mut preview)? else {
            eprintln!("tryon: nobody was dressed in {}", args.input.display());
            return Ok(ExitCode::FAILURE);
        };
        let (dressed, outfit) = free_start(args, &mut preview, dressed)?;
        let mut report = Report {
            garments: parts(&outfit),
            first_frame: dressed.index,
            sizes: preview.mirror.notes().to_vec(),
            ..Report::default()
        };
        let is_still = preview.is_still() || args.fine.still.is_some();
        if is_still {
            check_still(args)?;
            picture(&args.out, dressed.index, "_preview", &dressed.seen.picture)?;
        }
        let mut animation = Animation::start(args, &outfit, &preview, &dressed, &mut report)?;
        let flow = match is_still {
            true => animation.files.flow(),
            false => animation.run(&mut preview, &dressed, &mut report)?,
        };
        animation.finish(&preview, &mut report)?;
        report.peak_memory_bytes = peak_memory();
        write(&args.out.join("report.json"), &report)?;
        report.sizes.iter().for_each(|note| println!("{note}"));
        let (frames, out) = (report.frames, args.out.display());
        println!(
            "{frames} frames of {} vertices, pictures, positions.npy, body.npy, outfit.glb and report.json in {out}",
            outfit.cloth().len()
        );
        Ok(if flow.is_continue() {
            ExitCode::SUCCESS
        } else {
            ExitCode::from(INTERRUPTED)
        })
    })?
}

/// Runs the preview up to the frame to start from; `None` when nobody is dressed.
fn dress(args: &RunArgs, preview: &mut Preview) -> Result<Option<PreviewFrame>> {
    let last = preview.total.filter(|_| preview.is_still());
    let wanted = args.fine.still.or(last.map(|n| n.saturating_sub(1)));
    let bar = input::progress(preview.total.map(|n| n as u64), "dressing");
    while let Some(frame) = preview.next()? {
        bar.inc(1);
        if frame.seen.is_dressed && wanted.is_none_or(|w| frame.index >= w) {
            bar.finish_and_clear();
            return Ok(Some(frame));
        }
        if wanted.is_none() {
            picture(&args.out, frame.index, "", &frame.seen.picture)?;
        }
    }
    bar.finish_and_clear();
    Ok(None)
}

/// The first frame from `dressed` on whose cloth is free of intersections, or can be freed; its outfit.
fn free_start(
    args: &RunArgs,
    preview: &mut Preview,
    mut dressed: PreviewFrame,
) -> Result<(PreviewFrame, OfflineOutfit)> {
    let faces = preview.mirror.template().mesh().faces().to_vec();
    let mut left = LATER_STARTS;
    loop {
        let worn = worn(preview)?;
        let outfit = OfflineOutfit::new(worn, &faces, args.fine.vertices)?;
        let tangled = match outfit.start(worn, Par::Rayon) {
            Ok(_) => return Ok((dressed, outfit)),
            Err(e @ MirrorError::TangledStart { .. }) => e,
            Err(e) => return Err(e.into()),
        };
        if left == LATER_STARTS {
            eprintln!(
                "tryon: frame {}: {tangled}; trying later ones",
                dressed.index
            );
        }
        loop {
            if args.fine.still.is_none() && !preview.is_still() {
                picture(&args.out, dressed.index, "", &dressed.seen.picture)?;
            }
            left -= 1;
            match preview.next()?.filter(|_| left > 0) {
                Some(next) => dressed = next,
                None => return Err(tangled.into()),
            }
            if dressed.seen.is_dressed {
                break;
            }
        }
    }
}

fn worn(preview: &Preview) -> Result<&DressedOutfit> {
    preview.mirror.outfit().context("nobody is dressed")
}

fn parts(outfit: &OfflineOutfit) -> Vec<GarmentPart> {
    let garments = outfit.garments().iter();
    garment_parts(garments.map(|g| (g.name.as_str(), g.vertices)))
}

fn picture(out: &Path, index: usize, kind: &str, picture: &ColorImage) -> Result<()> {
    let path = out.join(format!("frame_{index:06}{kind}.png"));
    Ok(write_png_rgb(&path, picture)?)
}

/// Refuses a checkpoint for a drape in one pose.
fn check_still(args: &RunArgs) -> Result<()> {
    if args.solver.checkpoint.is_some() {
        bail!("a drape takes seconds and has no checkpoint");
    }
    Ok(())
}

/// Cloth at the first dressed frame and after it.
struct Animation<'a> {
    args: &'a RunArgs,
    simulation: OfflineRun<'a>,
    files: OfflineFiles,
    painter: OutfitPainter,
    /// Frames after the first one that an earlier run computed.
    resumed: usize,
    /// True while nobody is dressed in the preview.
    is_lost: bool,
}

impl<'a> Animation<'a> {
    /// At the first frame, from the preview or at a checkpoint.
    fn start(
        args: &'a RunArgs,
        outfit: &'a OfflineOutfit,
        preview: &Preview,
        first: &PreviewFrame,
        report: &mut Report,
    ) -> Result<Self> {
        let saved = saved_state(&args.solver)?;
        let known = saved.as_deref().map(checkpoint_frame).transpose()?;
        let resumed = known.unwrap_or(0) as usize;
        let frames = known.map_or(0, |_| resumed + 1);
        let body = preview.mirror.template().mesh().vertices().len();
        let vertices = VertexCounts {
            cloth: outfit.cloth().len(),
            body: Some(body),
        };
        let files = OfflineFiles::open(&args.solver, &args.out, vertices, frames)?;
        let simulation = match &saved {
            Some(bytes) => OfflineRun::resumed(outfit, bytes, Par::Rayon)?,
            None => {
                let (run, done) = settle(outfit, worn(preview)?, || files.flow())?;
                report.drape = done;
                run
            }
        };
        let mut out = Self {
            args,
            simulation,
            files,
            painter: OutfitPainter::new(input::template(&args.body)?),
            resumed,
            is_lost: false,
        };
        if saved.is_none() {
            let state = out.simulation.solver().state();
            (out.files).push(&state.positions(), &state.obstacle_positions())?;
            out.picture(preview, first)?;
        }
        Ok(out)
    }

    /// Writes the picture of a frame with the simulated cloth.
    fn picture(&mut self, preview: &Preview, frame: &PreviewFrame) -> Result<()> {
        let mirror = &preview.mirror;
        let fine = mirror.picture_of(&mut self.painter, &frame.frame, &self.simulation)?;
        picture(&self.args.out, frame.index, "", &fine)
    }

    /// Simulates to the end of the recording; breaks at the end of the frame in work after Ctrl-C.
    fn run(
        &mut self,
        preview: &mut Preview,
        first: &PreviewFrame,
        report: &mut Report,
    ) -> Result<ControlFlow<()>> {
        let left = preview.total.map(|n| (n - 1 - first.index) as u64);
        let bar = input::progress(left, "simulating");
        let mut clock = FrameClock::at(first.frame.time_ns);
        let (mut done, mut flow) = (0, ControlFlow::Continue(()));
        while let Some(frame) = preview.next()? {
            done += 1;
            let dt = time_step(clock.gap(frame.frame.time_ns));
            if done <= self.resumed {
                self.is_lost = !frame.seen.is_dressed;
                bar.inc(1);
                bar.reset_eta();
                continue;
            }
            self.frame(preview, &frame, dt, report)
                .with_context(|| format!("frame {}", frame.index))?;
            bar.inc(1);
            flow = self.files.frame(self.simulation.solver())?;
            if flow.is_break() {
                break;
            }
        }
        bar.finish_and_clear();
        Ok(flow)
    }

    /// Simulates one frame and writes its picture.
    fn frame(
        &mut self,
        preview: &Preview,
        frame: &PreviewFrame,
        dt: f64,
        report: &mut Report,
    ) -> Result<()> {
        if !frame.seen.is_dressed {
            self.is_lost = true;
            report.waited.push(frame.index);
            return picture(&self.args.out, frame.index, "", &frame.seen.picture);
        }
        let worn = worn(preview)?;
        if std::mem::take(&mut self.is_lost) {
            let outfit = self.simulation.outfit();
            (self.simulation, _) = settle(outfit, worn, || self.files.flow())?;
        }
        let started = Instant::now();
        let body = worn.state.collision_body().vertices();
        let work = self.simulation.follow(body, dt)?;
        report.work.push((work, started.elapsed().as_secs_f64()));
        self.picture(preview, frame)
    }

    /// Writes outfit.glb of all frames: each garment, and the body.
    fn finish(&mut self, preview: &Preview, report: &mut Report) -> Result<()> {
        let outfit = self.simulation.outfit();
        let frames = self.files.read()?;
        report.frames = frames.len();
        let mut motion: Vec<Vec<Vec<P3>>> = vec![Vec::new(); outfit.garments().len()];
        for frame in &frames {
            for (all, drawn) in motion.iter_mut().zip(outfit.drawn_positions(frame)) {
                all.push(drawn);
            }
        }
        motion.push(self.files.read_body()?);
        let colors = preview.mirror.looks().iter().map(|l| l.appearance.base);
        let garments = outfit.garments().iter().zip(colors);
        let surfaces = garments
            .map(|(g, color)| {
                (
                    g.name.as_str(),
                    &g.render.faces[..],
                    &g.render.uv[..],
                    color,
                )
            })
            .chain([(
                "body",
                preview.mirror.template().mesh().faces(),
                &[][..],
                SKIN,
            )]);
        let meshes: Vec<GlbMesh<'_>> = (surfaces.zip(&motion))
            .map(|((name, faces, uv, color), motion)| GlbMesh {
                name,
                vertices: motion.first().map_or(&[][..], Vec::as_slice),
                faces,
                uv,
                color,
                texture: &[],
            })
            .collect();
        let motion = if frames.len() > 1 { &motion[..] } else { &[] };
        write_glb_motion(
            &self.args.out.join("outfit.glb"),
            &meshes,
            motion,
            NOMINAL_INTERVAL as f32,
        )?;
        Ok(())
    }
}

/// Static drape from the preview, which leaves the cloth under stress by the offline fabric and contact. `flow` breaks off.
fn settle<'a>(
    outfit: &'a OfflineOutfit,
    worn: &DressedOutfit,
    flow: impl Fn() -> ControlFlow<()>,
) -> Result<(OfflineRun<'a>, OfflineDrapeReport)> {
    let bar = input::progress(None, "draping");
    let done = outfit.drape(worn, Par::Rayon, |vertices, step| {
        bar.set_message(format!(
            "{vertices} vertices, moved {:.1} mm",
            step.motion * 1e3
        ));
        bar.inc(1);
        flow()
    })?;
    bar.finish_and_clear();
    if let Some(level) = done.1.levels.last().filter(|l| !l.drape.settled) {
        eprintln!("tryon: the cloth is {}", level.drape);
    }
    Ok(done)
}
