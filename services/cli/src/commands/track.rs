//! `tryon track`: a recording to joints, poses and residuals, one JSON line a frame.

use crate::args::TrackArgs;
use crate::input;
use crate::overlay::overlay;
use anyhow::{Context, Result, ensure};
use serde_json::json;
use std::collections::BTreeMap;
use std::io::{BufWriter, Write};
use std::process::ExitCode;
use tryon::body::BoneTransforms;
use tryon::formats::RgbdSource;
use tryon::formats::image::write_png_rgb;
use tryon::formats::obj::write_obj;
use tryon::geometry::camera::{ColorImage, RgbdFrame};
use tryon::geometry::par::with_threads;
use tryon::tracking::{
    COLOR_INTERVAL, ColorEye, Status, StepReport, TrackerConfig, TrackerModel, TrackerState,
    Workspace, step,
};

/// Runs the command.
///
/// # Errors
/// Bad input, named; or results that cannot be written.
pub(crate) fn run(args: &TrackArgs) -> Result<ExitCode> {
    let mut source = args.recording.open(&args.input)?;
    let template = input::template(&args.body)?;
    let model = TrackerModel::new(
        template,
        source.calibration().clone(),
        TrackerConfig::default(),
    );
    let mut state = TrackerState::new(&model);
    if let Some(path) = &args.init {
        let start = input::rough_start(path)?;
        state.start_at(
            &model,
            start.root_position.into(),
            start.facing_yaw_deg.to_radians(),
        );
    }
    for dir in args.meshes.iter().chain(&args.overlay) {
        input::create_dir(dir)?;
    }
    let file = std::fs::File::create(&args.out)
        .with_context(|| format!("cannot write {}", args.out.display()))?;
    let mut out = BufWriter::new(file);
    with_threads(args.threads, || {
        track_all(args, source.as_mut(), &model, state, &mut out)
    })??;
    out.flush()
        .with_context(|| format!("cannot write {}", args.out.display()))?;
    Ok(ExitCode::SUCCESS)
}

fn track_all(
    args: &TrackArgs,
    source: &mut dyn RgbdSource,
    model: &TrackerModel,
    mut state: TrackerState,
    out: &mut impl Write,
) -> Result<()> {
    let bar = input::progress(source.len().map(|n| n as u64), "tracking");
    let mut workspace = Workspace::default();
    let calibration = model.calibration();
    let landmarker = args.color.landmarker()?;
    let mut eye = landmarker.map(|l| ColorEye::new(l, calibration.clone()));
    let mut live = 0u64;
    let mut index = 0usize;
    let mut bad = 0usize;
    loop {
        let frame = match source.next_frame() {
            Ok(Some(frame)) => frame,
            Ok(None) => break,
            Err(e) => {
                // A bad frame is reported and the recording continues behind it.
                eprintln!("tryon: frame {index} is left out: {e}");
                serde_json::to_writer(
                    &mut *out,
                    &json!({"frame": index, "status": "unreadable", "error": e.to_string()}),
                )?;
                out.write_all(b"\n")?;
                bar.inc(1);
                (index, bad) = (index + 1, bad + 1);
                continue;
            }
        };
        let is_due = (index as u64).is_multiple_of(COLOR_INTERVAL);
        if let Some(eye) = eye.as_mut().filter(|_| is_due)
            && let Some(sighting) = eye.look(&frame).with_context(|| format!("frame {index}"))?
        {
            state.see(sighting);
        }
        let started = std::time::Instant::now();
        let report = step(model, &mut state, &frame, &mut workspace)
            .with_context(|| format!("frame {index}"))?;
        let ms = started.elapsed().as_secs_f64() * 1e3;
        live += u64::from(state.status.is_live());
        let tracked = TrackedFrame {
            index,
            time_ns: frame.time_ns,
            state: &state,
            report: &report,
            ms,
        };
        serde_json::to_writer(&mut *out, &tracked.line(model))?;
        out.write_all(b"\n")?;
        if let Some(dir) = &args.meshes {
            let (vertices, _) = workspace.posed(model, &state);
            let faces = model.template().mesh().faces();
            write_obj(&dir.join(format!("{index:06}.obj")), vertices, faces, None)?;
        }
        if let Some(dir) = &args.overlay {
            let picture = drawn(model, &state, &frame, &mut workspace);
            write_png_rgb(&dir.join(format!("{index:06}.png")), &picture)?;
        }
        bar.inc(1);
        index += 1;
    }
    bar.finish_and_clear();
    ensure!(
        index > bad,
        "{}: no frame can be read",
        args.input.display()
    );
    println!(
        "{}: {live} of {index} frames with a live pose, in {}",
        args.input.display(),
        args.out.display()
    );
    Ok(())
}

/// The body over its depth image; the depth image alone without a live pose.
fn drawn(
    model: &TrackerModel,
    state: &TrackerState,
    frame: &RgbdFrame,
    workspace: &mut Workspace,
) -> ColorImage {
    let camera = &model.calibration().depth;
    if !state.status.is_live() {
        return overlay(&frame.depth, camera, &[], &[]);
    }
    let (vertices, _) = workspace.posed(model, state);
    let faces = model.template().mesh().faces();
    overlay(&frame.depth, camera, vertices, faces)
}

/// Result of one frame.
struct TrackedFrame<'a> {
    index: usize,
    time_ns: u64,
    state: &'a TrackerState,
    report: &'a StepReport,
    /// Time of the step, milliseconds.
    ms: f64,
}

impl TrackedFrame<'_> {
    /// Output line.
    fn line(&self, model: &TrackerModel) -> serde_json::Value {
        let Self { state, report, .. } = self;
        let mut line = json!({
            "frame": self.index,
            "time_ns": self.time_ns,
            "status": state.status,
            "residual_mm": report.residual_mm,
            "agreement": report.agreement,
            "visible_points": report.visible_points,
            "iterations": report.iterations,
            "converged": report.converged,
            "pose_age": report.pose_age,
            "skipped": report.skipped,
            "ms": self.ms,
            "stages_ms": report.stages_ms,
        });
        // Before anybody was found there is no body to speak of.
        if state.status == Status::Searching {
            return line;
        }
        let skeleton = model.template().skeleton();
        let rest = model.template().personalise(&state.shape);
        let mut bones = BoneTransforms::default();
        state.pose.bones(skeleton, &rest, &mut bones);
        let joints: BTreeMap<&str, [f64; 3]> = skeleton
            .joints()
            .iter()
            .zip(&bones.joints)
            .map(|(j, p)| (j.name.as_str(), [p.x, p.y, p.z]))
            .collect();
        let scales: BTreeMap<&str, f64> = skeleton
            .joints()
            .iter()
            .zip(&state.shape.bone_scales)
            .map(|(j, s)| (j.name.as_str(), *s))
            .collect();
        line["joints"] = json!(joints);
        line["girth_deviations_mm"] = json!(state.girth_deviations(model).map(|d| {
            let of = [("chest", d.chest), ("waist", d.waist), ("hip", d.hip)];
            BTreeMap::from(of.map(|(place, deviation)| (place, 1e3 * deviation)))
        }));
        line["pose"] = json!(state.pose);
        line["scales"] = json!(scales);
        line["shape"] = json!(state.shape.coefficients);
        line
    }
}
