//! `tryon simulate`: cloth in a scene file.

use crate::args::SimulateArgs;
use crate::input;
use crate::interrupt::INTERRUPTED;
use crate::offline_files::{OfflineFiles, VertexCounts, saved_state};
use crate::report::write;
use anyhow::Result;
use serde::Serialize;
use std::ops::ControlFlow;
use std::process::ExitCode;
use tryon::cloth::fine::{OfflineFrameReport, OfflineSettings, checkpoint_frame};
use tryon::cloth::scene::{self, FabricSolver, FabricTest, FabricTrial, OfflineScene, Scene};
use tryon::cloth::settings::FabricTestSettings;
use tryon::formats::gltf::{GlbMesh, write_glb_motion};
use tryon::geometry::math::P3;
use tryon::geometry::par::Par;

/// Share of its stiffness below which the cloth of a scene is said to be softened.
const KEPT: f64 = 0.995;
/// Base colour of the cloth in the animation, sRGB.
const CLOTH: [u8; 3] = [190, 190, 200];

/// Runs the command.
///
/// # Errors
/// A scene at fault, named by field, or results that cannot be written.
pub(crate) fn run(args: &SimulateArgs) -> Result<ExitCode> {
    let is_offline = args.solver.is_offline()?;
    if let Some(test) = args.scene.to_str().and_then(FabricTest::named) {
        return fabric_test(args, test, is_offline);
    }
    let scene = scene::load(&args.scene)?;
    input::create_dir(&args.out)?;
    if is_offline {
        offline(args, &scene)
    } else {
        realtime(args, &scene)
    }
}

/// Runs a textile test.
fn fabric_test(args: &SimulateArgs, test: FabricTest, is_offline: bool) -> Result<ExitCode> {
    let trial = FabricTrial {
        test,
        fabric: input::fabric(&args.fabric)?,
        solver: match is_offline {
            true => FabricSolver::Offline,
            false => FabricSolver::Realtime,
        },
        edge: args.edge,
    };
    input::create_dir(&args.out)?;
    let report = trial.run(&FabricTestSettings::default())?;
    write(&args.out.join("report.json"), &report)?;
    println!("{report}");
    Ok(ExitCode::SUCCESS)
}

/// Simulates by the real-time solver.
fn realtime(args: &SimulateArgs, scene: &Scene) -> Result<ExitCode> {
    let bar = input::progress(Some(scene.frames() as u64), "simulating");
    let mut frames = Vec::with_capacity(scene.frames());
    let report = scene::run(scene, &scene.config(), |_, positions| {
        frames.push(positions.to_vec());
        bar.inc(1);
        ControlFlow::Continue(())
    })?;
    bar.finish_and_clear();
    write(&args.out.join("report.json"), &report)?;
    scene::write_positions(&args.out.join("positions.npy"), &frames)?;
    println!("{} frames in {}", frames.len(), args.out.display());
    if report.softened < KEPT {
        eprintln!(
            "tryon: the cloth keeps {:.2} % of its stiffness, for it is too stiff for {} substeps a frame; --solver offline \
             keeps all of it",
            report.softened * 100.0,
            report.substeps
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// Report of the offline solver.
#[derive(Serialize)]
struct OfflineRun {
    /// Frames of the output, the start included.
    frames: usize,
    /// Frames that an earlier run computed, the start included.
    resumed: usize,
    vertices: usize,
    /// Computing time of the frames of this run (s).
    seconds: f64,
    /// Work of each frame of this run.
    work: Vec<OfflineFrameReport>,
}

/// Simulates by the offline solver.
fn offline(args: &SimulateArgs, scene: &Scene) -> Result<ExitCode> {
    let mut settings = OfflineSettings::default();
    settings.contact = settings.contact.filter(|_| !args.no_contact);
    settings.sleep = settings.sleep.filter(|_| !args.no_sleep);
    let saved = saved_state(&args.solver)?;
    let offline = OfflineScene::new(scene)?;
    let resumed = saved.as_deref().map_or(Ok(0), checkpoint_frame)? as usize;
    let known = saved.as_ref().map_or(0, |_| resumed + 1);
    let vertices = VertexCounts {
        cloth: scene.start.len(),
        body: None,
    };
    let mut files = OfflineFiles::open(&args.solver, &args.out, vertices, known)?;
    if saved.is_none() {
        files.push(&scene.start, &[])?;
    }

    let bar = input::progress(Some(scene.frames() as u64), "simulating");
    bar.set_position(resumed as u64 + 1);
    bar.reset_eta();
    let (mut work, mut seconds, mut fault) = (Vec::new(), 0.0, None);
    let simulated = offline.run(&settings, Par::Rayon, saved.as_deref(), |done, solver| {
        work.push(done.report);
        seconds = done.seconds[0];
        bar.inc(1);
        files.frame(solver).unwrap_or_else(|e| {
            fault = Some(e);
            ControlFlow::Break(())
        })
    });
    bar.finish_and_clear();
    fault.map_or(Ok(()), Err)?;
    simulated?;

    let frames = files.read()?;
    let report = OfflineRun {
        frames: frames.len(),
        resumed: known,
        vertices: scene.start.len(),
        seconds,
        work,
    };
    write(&args.out.join("report.json"), &report)?;
    write_animation(args, scene, &frames)?;
    println!("{} frames in {}", frames.len(), args.out.display());
    Ok(if frames.len() < scene.frames() {
        ExitCode::from(INTERRUPTED)
    } else {
        ExitCode::SUCCESS
    })
}

/// Writes animation.glb.
fn write_animation(args: &SimulateArgs, scene: &Scene, frames: &[Vec<P3>]) -> Result<()> {
    let cloth = GlbMesh {
        name: "cloth",
        vertices: &scene.start,
        faces: &scene.faces,
        uv: &[],
        color: CLOTH,
        texture: &[],
    };
    let (path, interval) = (args.out.join("animation.glb"), 1.0 / scene.rate);
    write_glb_motion(&path, &[cloth], &[frames.to_vec()], interval as f32)?;
    Ok(())
}
