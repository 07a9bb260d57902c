//! Tracks depth folders and prints the joint error against `truth.json`, for development and benchmarks.
//!
//! `cargo run --release --example track_sequences -- [--body FILE] [--set JSON] [--overlay DIR] [--jsonl DIR] FOLDER…`
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used)] // a development tool: stop at the first fault

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use tryon::body::{BoneTransforms, Template, import::template_from_smpl};
use tryon::camera::{Calibration, ColorImage, Intrinsics, RgbdFrame};
use tryon::formats::image::{read_png_depth, write_png_rgb};
use tryon::formats::npz::read_smpl;
use tryon::raster::{View, VisibilityBuffer, rasterise};
use tryon::tracking::{StepReport, TrackerConfig, TrackerModel, TrackerState, Workspace, step};

#[derive(serde::Deserialize)]
struct Truth {
    joint_names: Vec<String>,
    joints: Vec<Vec<[f64; 3]>>,
}

fn main() {
    let mut args = std::env::args().skip(1);
    let shared = std::env::var("TRYON_SHARED").unwrap_or_else(|_| "../shared".into());
    let mut body = PathBuf::from(shared).join("data/body/makehuman_smpl_layout/template.npz");
    let mut jsonl = None;
    let (mut config, mut overlay, mut folders, mut verbose) = (TrackerConfig::default(), None, vec![], false);
    while let Some(a) = args.next() {
        match a.as_str() {
            "--body" => body = args.next().expect("a file").into(),
            "--set" => config = serde_json::from_str(&args.next().expect("JSON")).expect("tracker settings"),
            "--jsonl" => jsonl = Some(PathBuf::from(args.next().expect("a folder"))),
            "--overlay" => overlay = Some(PathBuf::from(args.next().expect("a folder"))),
            "-v" => verbose = true,
            _ => folders.push(PathBuf::from(a)),
        }
    }
    let template = if body.as_os_str() == "embedded" {
        embedded()
    } else {
        Arc::new(template_from_smpl("body", &read_smpl(&body).expect("body")).expect("body"))
    };
    for folder in folders {
        run(&template, &config, &folder, overlay.as_deref(), jsonl.as_deref(), verbose);
    }
}

fn embedded() -> Arc<Template> {
    Arc::new(tryon::body::embedded::template().as_ref().clone())
}

fn run(
    template: &Arc<Template>,
    config: &TrackerConfig,
    folder: &Path,
    overlay: Option<&Path>,
    jsonl: Option<&Path>,
    verbose: bool,
) {
    let text = std::fs::read_to_string(folder.join("camera.json")).expect("camera.json");
    let camera: Intrinsics = serde_json::from_str(&text).expect("camera.json");
    let mut frames: Vec<PathBuf> =
        std::fs::read_dir(folder.join("depth")).expect("depth").map(|e| e.expect("entry").path()).collect();
    frames.sort();
    let truth: Option<Truth> =
        std::fs::read_to_string(folder.join("truth.json")).ok().map(|t| serde_json::from_str(&t).expect("truth.json"));
    let model = TrackerModel::new(template.clone(), Calibration::registered(camera), config.clone());
    let mut state = TrackerState::new(&model);
    let mut workspace = Workspace::default();
    let (mut errors, mut lost, mut times, mut per_joint) = (vec![], 0, vec![], vec![0.0; 64]);
    let (mut stages, mut cpus) = ([0.0; 5], vec![]);
    let mut lines = String::new();
    for (i, path) in frames.iter().enumerate() {
        let depth = read_png_depth(path).expect("depth");
        let frame = RgbdFrame { sequence: i as u64, time_ns: i as u64 * 33_333_333, depth, color: None };
        let (start, cpu) = (Instant::now(), cpu_ms());
        let report: StepReport = step(&model, &mut state, &frame, &mut workspace).expect("step");
        times.push(start.elapsed().as_secs_f64() * 1e3);
        cpus.push(cpu_ms() - cpu);
        let s = report.stages_ms;
        [s.segment, s.place, s.pose, s.size, s.surface].iter().zip(&mut stages).for_each(|(a, b)| *b += a);
        lost += usize::from(!state.status.is_live());
        let mut bones = BoneTransforms::default();
        let rest = workspace.rest_body(&model, &state.shape).clone();
        state.pose.bones(template.skeleton(), &rest, &mut bones);
        let joints: std::collections::BTreeMap<&str, [f64; 3]> = template
            .skeleton()
            .joints()
            .iter()
            .zip(&bones.joints)
            .map(|(j, p)| (j.name.as_str(), p.coords.into()))
            .collect();
        lines += &serde_json::json!({ "frame": i, "status": state.status, "joints": joints }).to_string();
        lines.push('\n');
        let mut mean = f64::NAN;
        if let Some(t) = &truth {
            let off: Vec<f64> = t
                .joint_names
                .iter()
                .zip(&t.joints[i])
                .map(|(n, p)| {
                    let j = template.skeleton().index(n).expect("joint");
                    (bones.joints[j].coords - nalgebra::Vector3::from(*p)).norm() * 1e3
                })
                .collect();
            mean = off.iter().sum::<f64>() / off.len() as f64;
            if i >= 30 {
                errors.push(mean);
                off.iter().zip(&mut per_joint).for_each(|(o, s)| *s += o);
            }
        }
        if verbose {
            println!(
                "{i:4} {:?} err {mean:6.1} it {:2} res {:5.2} expl {:.2} match {:.2} cells {} ms {:.2} (seg {:.2} pose {:.2} surf {:.2})",
                state.status,
                report.iterations,
                report.residual_mm,
                report.explained,
                report.matched,
                report.person_cells,
                times[i],
                s.segment,
                s.pose,
                s.surface
            );
        }
        if let Some(dir) = overlay.filter(|_| i % 15 == 0 || i + 1 == frames.len()) {
            std::fs::create_dir_all(dir).expect("overlay folder");
            let name = folder.file_name().expect("name").to_string_lossy().into_owned();
            let (vertices, _) = workspace.posed(&model, &state);
            let view = View::Perspective { camera, near: 0.1 };
            let mut buffer = VisibilityBuffer::default();
            rasterise(&view, vertices, template.mesh().faces(), &mut buffer);
            let mut image = ColorImage::filled(camera.width, camera.height, [0, 0, 0]);
            for (k, d) in frame.depth.data().iter().enumerate() {
                let z = f32::from(*d) * 1e-3;
                let shade = if z > 0.0 { (240.0 - (z - 1.2) * 70.0).clamp(20.0, 240.0) as u8 } else { 0 };
                let mut rgb = [shade; 3];
                if buffer.face[k] != VisibilityBuffer::NONE {
                    let f = template.mesh().faces()[buffer.face[k] as usize];
                    let n = tryon::mesh::face_normal(vertices, &f).normalize();
                    let l = (-n.z).clamp(0.0, 1.0);
                    rgb = [
                        (f32::from(shade) * 0.5) as u8,
                        (l * 160.0) as u8 / 2 + shade / 3,
                        (l * 120.0) as u8 + shade / 4,
                    ];
                }
                image.data_mut()[3 * k..3 * k + 3].copy_from_slice(&rgb);
            }
            write_png_rgb(&dir.join(format!("{name}_{i:04}.png")), &image).expect("png");
        }
    }
    if let Some(dir) = jsonl {
        std::fs::create_dir_all(dir).expect("jsonl folder");
        let name = folder.file_name().expect("name").to_string_lossy().into_owned();
        std::fs::write(dir.join(name + ".jsonl"), lines).expect("jsonl");
    }
    let n = errors.len().max(1) as f64;
    let steady: Vec<f64> = times.iter().skip(75.min(times.len() / 2)).copied().collect();
    let mut sorted = errors.clone();
    sorted.sort_by(f64::total_cmp);
    println!(
        "{}: mean {:.1} mm, p50 {:.1}, worst {:.1}, lost {lost}/{}, steady {:.2} ms/frame, of it on the processor {:.2} (first {:.0}), stages/frame seg {:.2} place {:.2} pose {:.2} size {:.2} surf {:.2}",
        folder.file_name().expect("name").to_string_lossy(),
        errors.iter().sum::<f64>() / n,
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN),
        sorted.last().copied().unwrap_or(f64::NAN),
        frames.len(),
        steady.iter().sum::<f64>() / steady.len() as f64,
        cpus.iter().skip(75.min(cpus.len() / 2)).sum::<f64>() / steady.len() as f64,
        times[0],
        stages[0] / times.len() as f64,
        stages[1] / times.len() as f64,
        stages[2] / times.len() as f64,
        stages[3] / times.len() as f64,
        stages[4] / times.len() as f64,
    );
    if verbose {
        if let Some(t) = &truth {
            let list: Vec<String> =
                t.joint_names.iter().zip(&per_joint).map(|(n, s)| format!("{n} {:.0}", s / n_of(&errors))).collect();
            println!("  per joint: {}", list.join(", "));
        }
        println!("  coefficients {:.2?}", state.shape.coefficients);
        println!("  scales {:.3?}", state.shape.bone_scales);
    }
}

fn n_of(errors: &[f64]) -> f64 {
    errors.len().max(1) as f64
}

/// Time this thread has spent on a processor (Linux), milliseconds: what counts on a busy machine.
fn cpu_ms() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split_whitespace().next().and_then(|n| n.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1e-6
}
