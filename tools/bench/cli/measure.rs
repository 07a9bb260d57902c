//! Tables of run time against error.

use crate::args::{
    ClothArgs, ClothcapArgs, DanceArgs, FoldsArgs, PeopleArgs, PictureArgs, StandingArgs,
    TrackingArgs, WornArgs,
};
use crate::progress::progress;
use anyhow::Result;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use tryon::garment::{Triangulation, library};
use tryon::geometry::par::with_threads;
use tryon_bench::cloth_offline::{self, OfflineBench};
use tryon_bench::dance::load;
use tryon_bench::folds::measure_folds;
use tryon_bench::garment_capture::{
    capture_scenes, made_scenes, measure, measure_turn_scene, turn_scenes,
};
use tryon_bench::people;
use tryon_bench::picture::{PicturePlan, measure_picture};
use tryon_bench::rest::measure_rest;
use tryon_bench::worn::{Wearer, WornPicture};
use tryon_bench::{EvaluateError, OutfitSpec, Table, cloth};

/// Frames of the dress without --frames.
const DRESS_FRAMES: usize = 4;

/// Runs `tryon-bench tracking`.
pub(crate) fn tracking(args: &TrackingArgs) -> Result<ExitCode> {
    let bar = progress(None, "measuring");
    let mut table = Table::new(
        "tracking",
        "one step on one thread, displacements amortised",
    );
    with_threads(1, || {
        args.plan.run(|row| {
            bar.inc(1);
            table.rows.push(row);
        })
    })??;
    bar.finish_and_clear();
    finish(&table, &args.out)
}

/// Runs `tryon-bench cloth`.
pub(crate) fn cloth(args: &ClothArgs) -> Result<ExitCode> {
    if let Some(folder) = &args.dress {
        return with_threads(args.threads, || dress_offline(args, folder))?;
    }
    if args.offline {
        return with_threads(args.threads, || offline_scenes(args))?;
    }
    let scenes = wanted(&args.scene, &cloth::SCENES);
    let bar = progress(None, "measuring");
    let table = cloth::cloth(&args.scenes, &scenes, |_| bar.inc(1))?;
    bar.finish_and_clear();
    finish(&table, &args.out)
}

/// The scenes asked for, or all.
fn wanted(asked: &[String], all: &[&str]) -> Vec<String> {
    match asked {
        [] => all.iter().map(|s| (*s).to_owned()).collect(),
        some => some.to_vec(),
    }
}

fn offline_scenes(args: &ClothArgs) -> Result<ExitCode> {
    let bench = OfflineBench {
        scenes: wanted(&args.scene, &cloth_offline::SCENES),
        full: args.full,
        frames: args.frames.unwrap_or(usize::MAX),
    };
    let bar = progress(None, "measuring");
    let table = cloth_offline::cloth_offline(&args.scenes, &bench, |row| {
        bar.set_message(format!("{}, {}", row.scene, row.method));
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    finish(&table, &args.out)
}

fn dress_offline(args: &ClothArgs, folder: &Path) -> Result<ExitCode> {
    let frames = args.frames.unwrap_or(DRESS_FRAMES);
    let bar = progress(Some(frames as u64), "measuring");
    let table = tryon_bench::dress_offline::dress_offline(folder, frames, |_| bar.inc(1))?;
    bar.finish_and_clear();
    finish(&table, &args.out)
}

/// Runs `tryon-bench dance`.
pub(crate) fn dance(args: &DanceArgs) -> Result<ExitCode> {
    let (worn, dance) = (&args.worn, load(&args.data)?);
    eprintln!("fitted template {:.1} mm off", dance.fit * 1e3);
    let outfit = worn.outfit()?;
    let report = with_threads(worn.threads, || dance.run(&outfit, args.seconds))??;
    let mut table = Table::new("dance", "one step of 1/60 s, median");
    table.rows.push(report.row("live step"));
    finish(&table, &worn.out)
}

/// Runs `tryon-bench standing`.
pub(crate) fn standing(args: &StandingArgs) -> Result<ExitCode> {
    let (worn, arms) = (&args.worn, args.arms.map(f64::to_radians));
    let outfit = worn.outfit()?;
    let bar = progress(None, "measuring");
    let mut table = Table::new("standing", "one step of 1/30 s, median");
    with_threads(worn.threads, || {
        measure_rest(&outfit, arms, args.steps, |row| {
            bar.inc(1);
            table.rows.push(row);
        })
    })??;
    bar.finish_and_clear();
    finish(&table, &worn.out)
}

/// Runs `tryon-bench worn`.
pub(crate) fn worn(args: &WornArgs) -> Result<ExitCode> {
    let edge = args.edge.unwrap_or(Triangulation::default().edge_length);
    let config = serde_json::from_str(&args.set)?;
    let outfits = wanted(&args.garment, library::names());
    let outfits = outfits.iter().map(|garments| OutfitSpec {
        garments: garments.split('+').map(str::to_owned).collect(),
        edge,
        config,
    });
    let outfits: Vec<_> = outfits.collect();
    let bar = progress(
        Some((args.motion.len() * outfits.len()) as u64),
        "measuring",
    );
    let mut table = Table::new("worn", "one step of 1/30 s, mean");
    let mut meshes = args
        .meshes
        .map(|every| MeshFolder::new(&args.out, every.get()))
        .transpose()?;
    with_threads(args.threads, || -> Result<()> {
        for motion in &args.motion {
            let wearer = Wearer::new(*motion, &args.data)?;
            for outfit in &outfits {
                let scene = wearer.scene(outfit);
                let report = wearer.wear(outfit, |picture| match &mut meshes {
                    Some(folder) => folder.add(&scene, picture),
                    None => Ok(()),
                })?;
                table.rows.push(wearer.row(outfit, &report));
                bar.inc(1);
            }
        }
        Ok(())
    })??;
    bar.finish_and_clear();
    if let Some(folder) = &meshes {
        folder.finish()?;
    }
    finish(&table, &args.out)
}

/// Runs `tryon-bench folds`.
pub(crate) fn folds(args: &FoldsArgs) -> Result<ExitCode> {
    let bar = progress(None, "measuring");
    let table = with_threads(args.threads, || {
        measure_folds(&args.bench(), |row| {
            bar.set_message(format!("{}, {}", row.scene, row.method));
            bar.inc(1);
        })
    })??;
    bar.finish_and_clear();
    finish(&table, &args.out)
}

/// Runs `tryon-bench picture`.
pub(crate) fn picture(args: &PictureArgs) -> Result<ExitCode> {
    let plan = PicturePlan {
        data: args.data.exists().then(|| args.data.clone()),
        only: args.only.clone(),
        quick: args.quick,
        pictures: Some(args.out.clone()),
    };
    let bar = progress(None, "measuring");
    let table = with_threads(args.threads, || {
        measure_picture(&plan, |row| {
            bar.set_message(row.scene.clone());
            bar.inc(1);
        })
    })??;
    bar.finish_and_clear();
    finish(&table, &args.out)
}

/// Folder of cloth as meshes, with the crossings that this project finds in each.
struct MeshFolder {
    folder: PathBuf,
    every: usize,
    crossings: BTreeMap<String, [usize; 2]>,
}

impl MeshFolder {
    fn new(out: &Path, every: usize) -> Result<Self> {
        let folder = out.join("meshes");
        std::fs::create_dir_all(&folder)?;
        Ok(Self {
            folder,
            every,
            crossings: BTreeMap::new(),
        })
    }
    fn add(&mut self, scene: &str, picture: &WornPicture<'_>) -> Result<(), EvaluateError> {
        if !picture.number.is_multiple_of(self.every) {
            return Ok(());
        }
        let name = format!("{scene}_{:04}.obj", picture.number);
        picture.write(&self.folder.join(&name))?;
        self.crossings.insert(name, picture.crossings);
        Ok(())
    }
    fn finish(&self) -> Result<()> {
        let text = serde_json::to_string_pretty(&self.crossings)?;
        Ok(std::fs::write(self.folder.join("crossings.json"), text)?)
    }
}

/// Runs `tryon-bench people`.
pub(crate) fn people(args: &PeopleArgs) -> Result<ExitCode> {
    let bar = progress(None, "measuring");
    let table = with_threads(1, || {
        people::run(&args.plan, |row| {
            bar.set_message(format!("{row} done"));
            bar.inc(1);
        })
    })??;
    bar.finish_and_clear();
    for file in table.write(&args.out)? {
        println!("{}", file.display());
    }
    print!("{}", table.to_markdown());
    for skipped in &table.skipped {
        eprintln!("SKIPPED: {skipped}");
    }
    Ok(ExitCode::SUCCESS)
}

/// Runs `tryon-bench clothcap`.
pub(crate) fn clothcap(args: &ClothcapArgs) -> Result<ExitCode> {
    let mut scenes = capture_scenes()?;
    let made = made_scenes(args.data.as_deref())?;
    scenes.extend(made.scenes);
    scenes.retain(|s| s.is_unseen == args.unseen);
    let is_wanted = |name: &str| args.only.is_empty() || args.only.iter().any(|o| name.contains(o));
    scenes.retain(|s| is_wanted(&s.name));
    let mut turns = turn_scenes()?;
    turns.retain(|s| s.is_unseen == args.unseen && is_wanted(&s.name));
    let bar = progress(Some((scenes.len() + turns.len()) as u64), "capturing");
    let mut table = Table::new("clothcap", "first scan, everything");
    for scene in &scenes {
        let row = with_threads(args.threads, || measure(scene, args.bodies))??;
        table.rows.push(row);
        bar.inc(1);
    }
    for scene in &turns {
        let rows = with_threads(args.threads, || measure_turn_scene(scene))??;
        table.rows.extend(rows);
        bar.inc(1);
    }
    bar.finish_and_clear();
    for skipped in &made.skipped {
        eprintln!("SKIPPED: {skipped}");
    }
    finish(&table, &args.out)
}

/// Writes the table and prints the paths of its files.
fn finish(table: &Table, out: &std::path::Path) -> Result<ExitCode> {
    for file in table.write(out)? {
        println!("{}", file.display());
    }
    print!("{}", table.to_markdown());
    Ok(ExitCode::SUCCESS)
}
