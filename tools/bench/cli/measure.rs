//! Tables and plots of run time against error.

use crate::args::{ClothArgs, ClothcapArgs, PeopleArgs, TrackingArgs};
use crate::progress::progress;
use anyhow::Result;
use std::path::Path;
use std::process::ExitCode;
use tryon::cloth::fine::OfflineSettings;
use tryon::geometry::par::with_threads;
use tryon_bench::ablation::{self, Extent};
use tryon_bench::cloth::ClothBench;
use tryon_bench::cloth_offline::OfflineBench;
use tryon_bench::dress_offline::DressBench;
use tryon_bench::garment_capture::{
    CaptureVariant, capture_scenes, made_scenes, measure_all, measure_turn_scene, turn_scenes,
};
use tryon_bench::people::{self, CaseSet, PeoplePlan};
use tryon_bench::{Row, Table};

/// Frames of the dress without --frames.
const DRESS_FRAMES: usize = 4;

/// Runs `tryon-bench tracking`.
///
/// # Errors
/// Scenes that cannot be read, or results that cannot be written.
pub(crate) fn tracking(args: &TrackingArgs) -> Result<ExitCode> {
    let extent = if args.quick {
        Extent::Quick
    } else {
        Extent::Full
    };
    let plan = ablation::plan(args.data.as_deref(), extent)?;
    let bar = progress(Some(plan.runs() as u64), "measuring");
    let mut table = Table::new(
        "tracking",
        command(args),
        "one step on one thread, displacements amortised",
    );
    with_threads(1, || {
        plan.run(|row: Row| {
            bar.inc(1);
            table.rows.push(row);
        })
    })??;
    bar.finish_and_clear();
    finish(&table, &args.out)
}

/// Runs `tryon-bench cloth`.
///
/// # Errors
/// Scenes that cannot be read, or results that cannot be written.
pub(crate) fn cloth(args: &ClothArgs) -> Result<ExitCode> {
    if let Some(folder) = &args.dress {
        return with_threads(args.threads, || dress_offline(args, folder))?;
    }
    if args.offline {
        return with_threads(args.threads, || cloth_offline(args))?;
    }
    let mut bench = ClothBench::default();
    if !args.scene.is_empty() {
        bench.scenes.clone_from(&args.scene);
    }
    let bar = progress(None, "measuring");
    let table = tryon_bench::cloth::cloth(&args.scenes, &bench, |_| bar.inc(1))?;
    bar.finish_and_clear();
    finish(&table, &args.out)
}

fn cloth_offline(args: &ClothArgs) -> Result<ExitCode> {
    let mut bench = OfflineBench {
        full: args.full,
        ..OfflineBench::default()
    };
    bench.frames = args.frames.unwrap_or(bench.frames);
    if !args.scene.is_empty() {
        bench.scenes.clone_from(&args.scene);
    }
    let bar = progress(None, "measuring");
    let mut table = tryon_bench::cloth_offline::cloth_offline(&args.scenes, &bench, |row| {
        bar.set_message(format!("{}, {}", row.scene, row.method));
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    table.command = std::env::args().collect::<Vec<_>>().join(" ");
    finish(&table, &args.out)
}

fn dress_offline(args: &ClothArgs, folder: &Path) -> Result<ExitCode> {
    let bench = DressBench {
        vertices: args.vertices,
        frames: args.frames.unwrap_or(DRESS_FRAMES),
        settings: OfflineSettings::default(),
    };
    let bar = progress(Some(bench.frames as u64), "measuring");
    let mut table = tryon_bench::dress_offline::dress_offline(folder, bench, |_| bar.inc(1))?;
    bar.finish_and_clear();
    table.command = std::env::args().collect::<Vec<_>>().join(" ");
    finish(&table, &args.out)
}

/// Runs `tryon-bench people`.
///
/// # Errors
/// Scenes that cannot be read, or results that cannot be written.
pub(crate) fn people(args: &PeopleArgs) -> Result<ExitCode> {
    let cases = if args.unseen {
        CaseSet::Unseen
    } else {
        CaseSet::Seen
    };
    let plan = PeoplePlan {
        data: args.data.clone(),
        cases,
        quick: args.quick,
        only: args.only.clone(),
        pictures: args.pictures.clone(),
    };
    let bar = progress(None, "measuring");
    let mut table = with_threads(1, || {
        people::run(&plan, |row| {
            bar.set_message(format!("{row} done"));
            bar.inc(1);
        })
    })??;
    bar.finish_and_clear();
    table.command = std::env::args().collect::<Vec<_>>().join(" ");
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
///
/// # Errors
/// Scenes that cannot be read, or results that cannot be written.
pub(crate) fn clothcap(args: &ClothcapArgs) -> Result<ExitCode> {
    let mut scenes = capture_scenes()?;
    let made = made_scenes(args.data.as_deref())?;
    scenes.extend(made.scenes);
    scenes.retain(|s| s.is_unseen == args.unseen);
    let is_wanted = |name: &str| args.only.is_empty() || args.only.iter().any(|o| name.contains(o));
    scenes.retain(|s| is_wanted(&s.name));
    let mut turns = turn_scenes()?;
    // Turns have one variant only.
    let has_variants = args.ablation || args.sweep;
    turns.retain(|s| !has_variants && s.is_unseen == args.unseen && is_wanted(&s.name));
    let variants = match (args.sweep, args.ablation) {
        (true, _) => CaptureVariant::sweep(),
        (_, true) => CaptureVariant::all(),
        _ => vec![CaptureVariant::whole()],
    };
    let runs = scenes.len() * variants.len() + turns.len();
    let bar = progress(Some(runs as u64), "capturing");
    let command = std::env::args().collect::<Vec<_>>().join(" ");
    let run_time = if args.sweep {
        "a later scan, everything"
    } else {
        "first scan, everything"
    };
    let mut table = Table::new("clothcap", command, run_time);
    for scene in &scenes {
        with_threads(args.threads, || {
            measure_all(scene, &variants, args.bodies, |row| {
                table.rows.push(row);
                bar.inc(1);
            })
        })??;
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

/// Command line that repeats the measurement.
fn command(args: &TrackingArgs) -> String {
    let data = args
        .data
        .as_ref()
        .map_or(String::new(), |d| format!(" --data {}", d.display()));
    let quick = if args.quick { " --quick" } else { "" };
    format!(
        "tryon-bench tracking --out {}{data}{quick}",
        args.out.display()
    )
}
