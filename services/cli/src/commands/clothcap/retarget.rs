//! `tryon clothcap retarget`: captured garments on other bodies.

use super::glb::DressedMotion;
use crate::args::{ClothcapRetargetArgs, Shard};
use crate::{input, report};
use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use tryon::body::{BodyShape, Pose, RestBody, Template};
use tryon::clothcap::align::Aligner;
use tryon::clothcap::archive::{CaptureArchive, CaptureHeader, FrameDisplacements};
use tryon::clothcap::picture::{Painted, PicturePanel, heading, part_color, sheet};
use tryon::clothcap::scan::{BodyScan, ScanFrame};
use tryon::clothcap::settings::AlignmentSettings;
use tryon::clothcap::texture::GarmentTexture;
use tryon::clothcap::{BodyDresser, CapturedOutfit, DressedPose, population};
use tryon::formats::image::{encode_png_rgb, write_png_rgb};
use tryon::formats::read_motion;
use tryon::formats::scan::ScanMesh;
use tryon::geometry::math::World;
use tryon::geometry::mesh::TriMesh;
use tryon::geometry::par::with_threads;
use tryon::synth::{Actor, Sequence, Setting};

/// Frames a second of captures and motions.
const RATE: f64 = 30.0;
/// Columns of the contact sheet.
const COLUMNS: usize = 5;
/// Most bodies on the contact sheet.
const MOST_ON_SHEET: usize = 20;

/// Runs the command.
pub(super) fn run(args: &ClothcapRetargetArgs) -> Result<()> {
    input::create_dir(&args.out)?;
    with_threads(args.threads, || retarget_all(args))?
}

/// Captured frames: pose and displacements.
struct CapturedFrames {
    /// Times, seconds.
    seconds: Vec<f64>,
    poses: Vec<Pose<World>>,
    displacements: Vec<FrameDisplacements>,
}

fn retarget_all(args: &ClothcapRetargetArgs) -> Result<()> {
    let template = tryon::body::embedded::template();
    let (archive, header) = CaptureArchive::open(&args.capture, &template)?;
    let mut frames = read_frames(&archive, &header, &template)?;
    if let Some(path) = &args.motion {
        frames = on_motion(path, &template, frames)?;
    }
    let mut bodies = bodies(args, &template)?;
    let Shard { index, count } = args.shard;
    bodies = bodies.into_iter().skip(index).step_by(count).collect();
    ensure!(
        !bodies.is_empty(),
        "--shard {index}/{count}: no body is left for this job"
    );
    let textures = archive.textures(&header)?;
    let encoded = textures
        .iter()
        .map(|t| encode_png_rgb(t.image(), &args.capture));
    let bar = input::progress(Some(bodies.len() as u64), "dressing");
    let mut batch = Batch {
        args,
        header: &header,
        textures: encoded.collect::<Result<_, _>>()?,
        frames: &frames,
        dresser: BodyDresser::new(template.clone(), &header.outfit.cloth)?,
        bodies: bodies.len(),
        shown: Vec::new(),
    };
    let mut rows = Vec::new();
    for body in &bodies {
        match batch.done(&body.name)? {
            Some(row) => {
                batch.show_done(body)?;
                rows.push(row);
                // It says nothing of the time that the others take.
                bar.dec_length(1);
            }
            None => {
                rows.push(batch.dress(body)?);
                bar.inc(1);
            }
        }
    }
    bar.finish_and_clear();
    let suffix = if count > 1 {
        format!("_{index}")
    } else {
        String::new()
    };
    if !batch.shown.is_empty() {
        let sheet = args.out.join(format!("sheet{suffix}.png"));
        contact_sheet(&template, &header.outfit, &textures, &batch.shown, &sheet)?;
    }
    let report = json!({
        "capture": args.capture,
        "bodies": rows,
        "peak_memory_bytes": report::peak_memory(),
    });
    report::write(&args.out.join(format!("report{suffix}.json")), &report)?;
    println!("{} bodies dressed, in {}", bodies.len(), args.out.display());
    Ok(())
}

/// Bodies of one job.
struct Batch<'a> {
    args: &'a ClothcapRetargetArgs,
    header: &'a CaptureHeader,
    /// PNG files.
    textures: Vec<Vec<u8>>,
    frames: &'a CapturedFrames,
    dresser: BodyDresser<'a>,
    bodies: usize,
    /// Poses for the contact sheet.
    shown: Vec<DressedPose>,
}

impl Batch<'_> {
    /// The job of every body, as its row of the report names it.
    fn job(&self) -> Value {
        let args = self.args;
        json!({
            "capture": args.capture,
            "body": args.body.file(),
            "seed": args.seed,
            "motion": args.motion,
            "obj": args.obj,
            "scans": self.header.scans,
        })
    }

    fn row_path(&self, name: &str) -> PathBuf {
        self.args.out.join(format!("{name}.json"))
    }

    /// Row of a body that was dressed before by the same job.
    fn done(&self, name: &str) -> Result<Option<Value>> {
        let path = self.row_path(name);
        if !path.exists() {
            return Ok(None);
        }
        let row = input::json(&path)?;
        Ok((row["job"] == self.job()).then_some(row))
    }

    /// Dresses one body in all frames and writes it; its row of the report.
    fn dress(&mut self, body: &NamedBody) -> Result<Value> {
        let (name, frames) = (&body.name, self.frames);
        let started = Instant::now();
        let mut dressed = Vec::new();
        for frame in 0..frames.poses.len() {
            dressed.push(self.dress_frame(body, frame)?);
        }
        let dressing = started.elapsed();
        let motion = DressedMotion {
            surface: self.dresser.surface(),
            header: self.header,
            textures: &self.textures,
            body: &body.rest,
            frames: &dressed,
            seconds: &frames.seconds,
            has_targets: self.args.motion.is_none(),
        };
        motion.write(&self.args.out.join(format!("{name}.glb")))?;
        if self.args.obj {
            motion.write_obj(&self.args.out.join(format!("{name}.obj")))?;
        }
        let row = json!({
            "body": name,
            "job": self.job(),
            "frames": dressed.iter().map(|f| &f.reports).collect::<Vec<_>>(),
            "dressing_ms": dressing.as_secs_f64() * 1e3,
            "ms": started.elapsed().as_secs_f64() * 1e3,
        });
        // Last of the body's files: it stands for a whole result.
        report::write(&self.row_path(name), &row)?;
        let room = self.room();
        let every = self.every();
        self.shown
            .extend(dressed.into_iter().step_by(every).take(room));
        Ok(row)
    }

    fn dress_frame(&mut self, body: &NamedBody, frame: usize) -> Result<DressedPose> {
        let (pose, d) = (&self.frames.poses[frame], &self.frames.displacements[frame]);
        let dressed = self.dresser.dress(&body.rest, d, pose);
        dressed.with_context(|| body.name.clone())
    }

    /// Dresses a body that is done once more, for the contact sheet, as far as that has room for it.
    fn show_done(&mut self, body: &NamedBody) -> Result<()> {
        let frames = (0..self.frames.poses.len()).step_by(self.every());
        for frame in frames.take(self.room()) {
            let dressed = self.dress_frame(body, frame)?;
            self.shown.push(dressed);
        }
        Ok(())
    }

    /// Frames between those of one body on the contact sheet: many bodies show their first pose, one or two some of their
    /// motion.
    fn every(&self) -> usize {
        let frames = self.frames.poses.len();
        let each = (MOST_ON_SHEET / self.bodies).clamp(1, frames);
        frames.div_ceil(each)
    }

    /// Room on the contact sheet.
    fn room(&self) -> usize {
        MOST_ON_SHEET.saturating_sub(self.shown.len())
    }
}

fn read_frames(
    archive: &CaptureArchive,
    header: &CaptureHeader,
    template: &Template,
) -> Result<CapturedFrames> {
    let mut out = CapturedFrames {
        seconds: Vec::new(),
        poses: Vec::new(),
        displacements: Vec::new(),
    };
    for scan in &header.scans {
        let Some(record) = archive.record(scan, template)? else {
            continue;
        };
        out.seconds.push(out.poses.len() as f64 / RATE);
        out.poses.push(record.body.pose);
        out.displacements
            .push(archive.displacements(scan, header, template)?);
    }
    ensure!(!out.poses.is_empty(), "the capture has no finished scan");
    Ok(out)
}

/// The first scan's garments in the poses of a clip.
fn on_motion(
    path: &Path,
    template: &Arc<Template>,
    frames: CapturedFrames,
) -> Result<CapturedFrames> {
    let clip = read_motion(path)?;
    let count = (clip.seconds() * RATE).floor() as u64;
    let setting = Setting {
        rate: RATE,
        ..Setting::default()
    };
    let actor = Actor {
        template: template.clone(),
        ..Actor::default()
    };
    let world_from_camera = setting.world_from_camera;
    let sequence = Sequence::new(actor, setting)
        .with_clip(clip)
        .with_context(|| format!("{}", path.display()))?;
    for note in sequence.clip_notes() {
        eprintln!("{}: {note}", path.display());
    }
    // The calibration pose before the clip is not part of it.
    let lead = (sequence.clip_lead() * RATE).round() as u64;
    let pose = |i| {
        sequence
            .truth(lead + i)
            .pose
            .transformed(&world_from_camera)
    };
    let first = frames.displacements.into_iter().next();
    let first = first.context("the capture has no finished scan")?;
    let poses: Vec<_> = (0..count.max(1)).map(pose).collect();
    Ok(CapturedFrames {
        seconds: (0..poses.len()).map(|i| i as f64 / RATE).collect(),
        displacements: vec![first; poses.len()],
        poses,
    })
}

/// Body with its name in results.
struct NamedBody {
    name: String,
    rest: RestBody,
}

/// Bodies of the command.
fn bodies(args: &ClothcapRetargetArgs, template: &Arc<Template>) -> Result<Vec<NamedBody>> {
    if let Some(path) = args.body.file() {
        let body = input::template(&args.body)?;
        let name = path.file_stem().map(|s| s.to_string_lossy().into_owned());
        return Ok(vec![NamedBody {
            name: name.unwrap_or_else(|| "body".into()),
            rest: fitted(body.mesh(), template).with_context(|| format!("{}", path.display()))?,
        }]);
    }
    let count = args.population.unwrap_or(0);
    ensure!(count > 0, "--population: at least one body");
    let all = population(template, count, args.seed);
    let named = |(k, shape): (usize, &BodyShape)| NamedBody {
        name: format!("{k:04}"),
        rest: template.personalise(shape),
    };
    Ok(all.iter().enumerate().map(named).collect())
}

/// Body of another topology: the template fitted to its surface, in the rest pose.
fn fitted(body: &TriMesh, template: &Arc<Template>) -> Result<RestBody> {
    let file = ScanMesh {
        points: body.vertices().to_vec(),
        faces: body.faces().to_vec(),
        ..ScanMesh::default()
    };
    let scan = BodyScan::new(&file, &ScanFrame::default())?;
    let mut aligner = Aligner::new(template.clone(), AlignmentSettings::default())?;
    aligner.align(&scan)?;
    let clothed = aligner.clothed().context("no body was fitted")?;
    let shaped = template.personalise(&BodyShape {
        displacements: Vec::new(),
        ..clothed.body.shape.clone()
    });
    Ok(RestBody {
        vertices: clothed.rest.clone(),
        ..shaped
    })
}

fn contact_sheet(
    template: &Template,
    outfit: &CapturedOutfit,
    textures: &[GarmentTexture],
    shown: &[DressedPose],
    out: &Path,
) -> Result<()> {
    let skin = vec![part_color(0); template.mesh().vertices().len()];
    let body = |points| Painted {
        points,
        faces: template.mesh().faces(),
        colors: &skin,
        texture: None,
    };
    let panels: Vec<PicturePanel<'_>> = shown
        .iter()
        .map(|d| {
            let garments = d.garments.iter().enumerate();
            let worn = garments.map(|(k, points)| Painted::garment(outfit, textures, k, points));
            PicturePanel {
                meshes: std::iter::once(body(&d.body)).chain(worn).collect(),
                yaw: heading(&d.pose),
            }
        })
        .collect();
    Ok(write_png_rgb(out, &sheet(&panels, COLUMNS))?)
}
