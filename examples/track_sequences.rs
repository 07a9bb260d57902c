//! Tracks depth folders and prints every measure of error against their truth, for development and benchmarks.
//!
//! `cargo run --release --example track_sequences -- [--body FILE]… [--set JSON]… [--synth] [--hard] [--upper] [--own] [--frames N] [--still N]
//! [--corrupt SHARE] [--thin SHARE] [--nth N] [--cut SHARE] [--overlay DIR] [--every N] [--labels DIR] [--jsonl DIR] [--stages] [--tremble] [-v] FOLDER…`
//!
//! Each combination of body and settings is run on each folder and, with `--synth`, on the synthetic scenes; `--upper` adds
//! clips of which the picture shows no feet, `--own` gives each recorded or clipped scene its subject's own body.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used)] // a development tool: stop at the first fault

use std::path::{Path, PathBuf};
use std::sync::Arc;
use tryon::body::{BoneTransforms, Template, import::template_from_smpl};
use tryon::camera::{ColorImage, NoiseModel, RgbdFrame};
use tryon::evaluate::tracking::{follow, mean, median};
use tryon::evaluate::{Scene, scenes};
use tryon::formats::image::write_png_rgb;
use tryon::formats::npz::read_smpl;
use tryon::formats::read_motion;
use tryon::mesh::face_normal;
use tryon::raster::{View, VisibilityBuffer, rasterise};
use tryon::segment::{SegmentScratch, find_person, find_planes};
use tryon::spatial::{Label, OrganisedCloud};
use tryon::synth::{Actor, Routine, Sequence, Setting};
use tryon::tracking::{TrackerConfig, TrackerModel, TrackerState, Workspace};

#[derive(Default)]
struct Args {
    bodies: Vec<PathBuf>,
    settings: Vec<String>,
    folders: Vec<PathBuf>,
    synth: bool,
    upper: bool,
    own: bool,
    frames: Option<usize>,
    still: usize,
    overlay: Option<PathBuf>,
    every: usize,
    jsonl: Option<PathBuf>,
    stages: bool,
    corrupt: f64,
    thin: f64,
    nth: usize,
    cut: f64,
    labels: Option<PathBuf>,
    hard: bool,
    drift: Option<u64>,
    tremble: bool,
    verbose: bool,
}

fn main() {
    let shared =
        PathBuf::from(std::env::var("TRYON_SHARED").unwrap_or_else(|_| "../shared".into()));
    let mut a = Args {
        still: 10,
        every: 15,
        nth: 1,
        cut: 1.0,
        ..Args::default()
    };
    let mut args = std::env::args().skip(1);
    while let Some(word) = args.next() {
        let mut next = || args.next().expect("a value");
        match word.as_str() {
            "--body" => a.bodies.push(next().into()),
            "--set" => a.settings.push(next()),
            "--frames" => a.frames = Some(next().parse().expect("a number")),
            "--still" => a.still = next().parse().expect("a number"),
            "--every" => a.every = next().parse().expect("a number"),
            "--jsonl" => a.jsonl = Some(next().into()),
            "--overlay" => a.overlay = Some(next().into()),
            "--corrupt" => a.corrupt = next().parse().expect("a share"),
            "--thin" => a.thin = next().parse().expect("a share"),
            "--nth" => a.nth = next().parse().expect("a number"),
            "--cut" => a.cut = next().parse().expect("a share"),
            "--hard" => a.hard = true,
            "--drift" => a.drift = Some(next().parse().expect("a number")),
            "--labels" => a.labels = Some(next().into()),
            "--synth" => a.synth = true,
            "--upper" => a.upper = true,
            "--own" => a.own = true,
            "--stages" => a.stages = true,
            "--tremble" => a.tremble = true,
            "-v" => a.verbose = true,
            _ => a.folders.push(word.into()),
        }
    }
    if a.bodies.is_empty() {
        a.bodies
            .push(shared.join("data/body/makehuman_smpl_layout/template.npz"));
    }
    if a.settings.is_empty() {
        a.settings.push("{}".into());
    }
    if let Some(frames) = a.drift {
        for settings in &a.settings {
            println!("drift over {frames} frames {settings}");
            drift(&a, settings, frames);
        }
        return;
    }
    if a.tremble {
        for settings in &a.settings {
            tremble(&a, settings);
        }
        return;
    }
    let bodies: Vec<Arc<Template>> = a.bodies.iter().map(|b| body(b)).collect();
    let mut all: Vec<(Option<&str>, Maker)> = vec![];
    for folder in &a.folders {
        if let Some(dir) = &a.labels {
            labels(dir, &Scene::open(folder).expect("a scene"), a.every);
        }
        if folder.join("joints.json").exists() {
            for (template, path) in bodies.iter().zip(&a.bodies) {
                for settings in &a.settings {
                    stills(
                        &a,
                        template,
                        settings,
                        folder,
                        &path.file_stem().unwrap_or_default().to_string_lossy(),
                    );
                }
            }
            continue;
        }
        let folder = folder.clone();
        let name = folder.to_string_lossy().into_owned();
        let own = SUBJECTS
            .into_iter()
            .find(|s| name.contains(s.trim_start_matches("subject_")));
        all.push((
            own,
            Box::new(move || Scene::open(&folder).expect("a scene")),
        ));
    }
    if a.synth {
        for name in scenes::unseen_names() {
            let data = shared.join("data");
            all.push((
                None,
                Box::new(move || scenes::unseen(&data, name).expect("a scene")),
            ));
        }
    }
    if a.upper {
        for spec in &UPPER {
            let data = shared.join("data");
            all.push((Some(spec.1), Box::new(move || upper(&data, spec))));
        }
    }
    if a.hard {
        let data = shared.join("data");
        all.push((
            None,
            Box::new(move || scenes::hard(&data).expect("scenes").swap_remove(2)),
        ));
        for i in 0..2 {
            let data = shared.join("data");
            all.push((
                None,
                Box::new(move || scenes::hard(&data).expect("scenes").swap_remove(i)),
            ));
            let data = shared.join("data");
            all.push((
                None,
                Box::new(move || scenes::idle(&data).expect("scenes").swap_remove(i)),
            ));
        }
    }
    for (own, make) in all {
        let mut scene = make();
        if scene.frames.len() == 1 {
            // A still is shown over and over.
            let one = scene.frames[0].clone();
            scene.frames = (0..a.still as u64)
                .map(|i| RgbdFrame {
                    sequence: i,
                    time_ns: i * 33_333_333,
                    ..one.clone()
                })
                .collect();
        }
        scene.frames.truncate(a.frames.unwrap_or(usize::MAX));
        if a.corrupt > 0.0 {
            scene = scene.corrupted(a.corrupt);
        }
        if a.thin > 0.0 {
            scene = scene.thinned(a.thin);
        }
        if a.nth > 1 {
            scene = scene.every(a.nth);
        }
        if a.cut < 1.0 {
            scene = scene.cut_below(a.cut);
        }
        let subject = own
            .filter(|_| a.own)
            .map(|name| scenes::subject(&shared.join("data"), name).expect("a body"));
        for (template, path) in bodies.iter().zip(&a.bodies) {
            let template = subject.as_ref().unwrap_or(template);
            for settings in &a.settings {
                let config = configuration(settings);
                let label = if a.settings.len() * bodies.len() > 1 {
                    format!(
                        " {} {settings}",
                        path.file_stem().unwrap_or_default().to_string_lossy()
                    )
                } else {
                    String::new()
                };
                run(&a, template, &config, &scene, &label);
            }
        }
    }
}

type Maker = Box<dyn Fn() -> Scene>;

/// Bodies that scenes were made with.
const SUBJECTS: [&str; 4] = [
    "subject_f_avg",
    "subject_f_short_heavy",
    "subject_m_heavy",
    "subject_m_tall",
];

/// Name, body, clip, noise, camera height and distance (metres), frames until it walks out of the picture: clips of which the picture shows no feet.
type Upper = (
    &'static str,
    &'static str,
    &'static str,
    NoiseModel,
    [f64; 2],
    u64,
);

/// The lower rim of the picture is 0.456 × distance below the camera's height: at the shins, the knees and the thighs.
const UPPER: [Upper; 5] = [
    (
        "shins_13_31_f_avg",
        "subject_f_avg",
        "cmu_asf_amc/13_31.amc",
        NoiseModel::KinectV1,
        [1.45, 2.6],
        150,
    ),
    (
        "knees_93_04_m_heavy",
        "subject_m_heavy",
        "cmu_asf_amc/93_04.amc",
        NoiseModel::TimeOfFlight,
        [1.5, 2.2],
        150,
    ),
    (
        "thighs_02_07_f_short",
        "subject_f_short_heavy",
        "cmu_asf_amc/02_07.amc",
        NoiseModel::KinectV1,
        [1.45, 1.9],
        150,
    ),
    (
        "knees_walk_m_tall",
        "subject_m_tall",
        "cmu_bvh/02_03.bvh",
        NoiseModel::TimeOfFlight,
        [1.5, 2.3],
        75,
    ),
    (
        "knees_02_02_f_avg",
        "subject_f_avg",
        "cmu_bvh/02_02_makehuman.bvh",
        NoiseModel::TimeOfFlight,
        [1.4, 2.2],
        90,
    ),
];

fn upper(data: &Path, &(name, body, clip, noise, [height, away], frames): &Upper) -> Scene {
    let subject = Actor {
        template: scenes::subject(data, body).expect("a body"),
        ..Actor::default()
    };
    let setting = Setting {
        world_from_camera: Setting::tilted(height, 0.0, 0.0),
        home: nalgebra::Point3::new(0.0, 0.0, -away),
        room: None,
        noise,
        color: false,
        seed: 13,
        ..Setting::default()
    };
    let motion = read_motion(&data.join("motion").join(clip)).expect("a clip");
    let sequence = Sequence::new(subject, setting)
        .with_clip(motion.at_cmu_rate())
        .expect("a clip of a person");
    Scene::synthetic(name, &sequence, frames)
}

/// `paper`, or JSON.
fn configuration(settings: &str) -> TrackerConfig {
    if settings == "paper" {
        return TrackerConfig::paper();
    }
    serde_json::from_str(settings).expect("tracker settings")
}

fn body(path: &Path) -> Arc<Template> {
    if path.as_os_str() == "embedded" {
        return tryon::body::embedded::template();
    }
    Arc::new(template_from_smpl("body", &read_smpl(path).expect("body")).expect("body"))
}

/// Frame, status and joints (camera frame, metres) as one line of JSON.
fn joints_line(
    model: &TrackerModel,
    state: &TrackerState,
    workspace: &mut Workspace,
    frame: usize,
) -> String {
    let skeleton = model.template().skeleton();
    let rest = workspace.rest_body(model, &state.shape).clone();
    let mut bones = BoneTransforms::default();
    state.pose.bones(skeleton, &rest, &mut bones);
    let named = skeleton
        .joints()
        .iter()
        .zip(&bones.joints)
        .map(|(j, p)| (j.name.as_str(), p.coords.into()));
    let joints: std::collections::BTreeMap<&str, [f64; 3]> = named.collect();
    serde_json::json!({ "frame": frame, "status": state.status, "joints": joints }).to_string()
}

fn run(a: &Args, template: &Arc<Template>, config: &TrackerConfig, scene: &Scene, label: &str) {
    let mut lines = String::new();
    let out = follow(
        template,
        config,
        scene,
        |i, model, state, report, workspace| {
            if a.jsonl.is_some() {
                lines += &joints_line(model, state, workspace, i);
                lines.push('\n');
            }
            if a.verbose {
                let rest = workspace.rest_body(model, &state.shape).clone();
                let mut bones = BoneTransforms::default();
                state.pose.bones(template.skeleton(), &rest, &mut bones);
                let off: Vec<f64> = scene.truth.get(i).map_or(vec![], |t| {
                    let at =
                        |n: &String| bones.joints[template.skeleton().index(n).expect("joint")];
                    scene
                        .joint_names
                        .iter()
                        .zip(&t.joints)
                        .map(|(n, p)| (at(n) - p).norm() * 1e3)
                        .collect()
                });
                let s = report.stages_ms;
                println!(
                    "{i:4} {:?} err {:6.1} it {:2} res {:5.2} expl {:.2} match {:.2} cells {} seg {:.2} pose {:.2} size {:.2} surf {:.2}",
                    state.status,
                    mean(&off),
                    report.iterations,
                    report.residual_mm,
                    report.explained,
                    report.matched,
                    report.person_cells,
                    s.segment,
                    s.pose,
                    s.size,
                    s.surface
                );
            }
            if let Some(dir) = a
                .overlay
                .as_ref()
                .filter(|_| i % a.every == 0 || i + 1 == scene.frames.len())
            {
                std::fs::create_dir_all(dir).expect("overlay folder");
                let image = overlay(template, model, state, workspace, scene, i);
                write_png_rgb(&dir.join(format!("{}_{i:04}.png", scene.name)), &image)
                    .expect("png");
            }
        },
    );
    if let Some(dir) = &a.jsonl {
        std::fs::create_dir_all(dir).expect("jsonl folder");
        std::fs::write(dir.join(format!("{}.jsonl", scene.name)), lines).expect("jsonl");
    }
    let size: f64 = out.stages.iter().map(|s| s.size).fold(0.0, f64::max);
    println!(
        "{}{label}: joints {:.1} mm (worst frame {:.1}), visible {:.1}, whole {:.1}, vertices {:.1} mm, bones {:.1} %, lost {}, found {:?}, step {:.2} ms, pose+skin {:.2}, size {size:.0}, residual {:.2}",
        scene.name,
        mean(&out.joints_mm),
        out.joints_mm.iter().copied().fold(f64::NAN, f64::max),
        out.visible_mm,
        out.whole_mm,
        out.vertices_mm,
        out.bones_percent,
        out.lost,
        out.found,
        out.steady_ms(),
        out.stage_ms(|s| s.pose) + out.posing_ms(),
        out.last.as_ref().map_or(f64::NAN, |r| r.residual_mm),
    );
    if a.stages {
        println!(
            "  stages: segment {:.2}, pose {:.2}, size {:.2}, surface {:.2}, skin {:.2}; first frame place {:.1}, size {:.1}; {:.1} iterations",
            out.stage_ms(|s| s.segment),
            out.stage_ms(|s| s.pose),
            out.stage_ms(|s| s.size),
            out.stage_ms(|s| s.surface),
            out.posing_ms(),
            out.stages.iter().map(|s| s.place).fold(0.0, f64::max),
            size,
            mean(&out.iterations),
        );
    }
    if a.verbose || a.stages {
        let list: Vec<String> = scene
            .joint_names
            .iter()
            .zip(&out.per_joint_mm)
            .map(|(n, s)| format!("{n} {s:.0}"))
            .collect();
        println!("  per joint: {}", list.join(", "));
    }
}

/// Frames of the routine back and forth (`--frames`, 30) with the body that is tracked: how far each joint is at each
/// picture of a round from where it was in the second round, at rounds that grow by a half.
fn drift(a: &Args, settings: &str, frames: u64) {
    let subject = Actor::default();
    let template = subject.template.clone();
    let noise = if a.hard {
        NoiseModel::KinectV1
    } else {
        NoiseModel::None
    };
    let setting = Setting {
        routine: Routine::TryOn,
        noise,
        color: false,
        ..Setting::default()
    };
    let length = a.frames.unwrap_or(30) as u64;
    let scene = Scene::synthetic("drift", &Sequence::new(subject, setting), length);
    let config = TrackerConfig {
        adapt_size: false,
        displacements: false,
        ..configuration(settings)
    };
    let model = TrackerModel::new(template.clone(), scene.calibration.clone(), config);
    let mut state = TrackerState::new(&model);
    let mut workspace = Workspace::default();
    let names: Vec<&str> = template
        .skeleton()
        .joints()
        .iter()
        .map(|j| j.name.as_str())
        .collect();
    let (mut second, mut due, mut iterations) = (vec![], 2, 0);
    let (mut worst, mut sum) = ((0.0, 0, 0), 0.0);
    for i in 0..frames / (2 * length) * 2 * length {
        let (round, k) = (i / (2 * length), (i % (2 * length)) as usize);
        let picture = &scene.frames[k.min(2 * length as usize - 1 - k)];
        let frame = RgbdFrame {
            sequence: i,
            time_ns: i * 33_333_333,
            ..picture.clone()
        };
        iterations += tryon::tracking::step(&model, &mut state, &frame, &mut workspace)
            .expect("step")
            .iterations;
        if round == 1 || round == due {
            let (_, bones) = workspace.posed(&model, &state);
            if round == 1 {
                second.push(bones.joints.clone());
                continue;
            }
            let off: Vec<f64> = second[k]
                .iter()
                .zip(&bones.joints)
                .map(|(a, b)| (a - b).norm() * 1e3)
                .collect();
            sum += mean(&off);
            for (j, o) in off.iter().enumerate() {
                if *o > worst.0 {
                    worst = (*o, j, k);
                }
            }
            if k as u64 == 2 * length - 1 {
                println!(
                    "round {round:5}, frame {:7}: worst {:.3} mm ({}, picture {}), mean {:.4} mm, {:.2} iterations a frame",
                    i + 1,
                    worst.0,
                    names[worst.1],
                    worst.2,
                    sum / (2 * length) as f64,
                    iterations as f64 / (i + 1) as f64
                );
                due = (round * 3).div_ceil(2).max(due + 1);
                (worst, sum) = ((0.0, 0, 0), 0.0);
            }
        }
    }
}

/// How much the skin of a person who stands still moves (`--frames`, 180; embedded body, Kinect v1 noise), from picture to
/// picture and within a third of a second: mean over vertices and pictures from the second second on, and the worst
/// twentieth.
fn tremble(a: &Args, settings: &str) {
    for (name, routine) in [("still", Routine::Still), ("moving", Routine::TryOn)] {
        let setting = Setting {
            routine,
            noise: NoiseModel::KinectV1,
            color: false,
            ..Setting::default()
        };
        let frames = a.frames.unwrap_or(180) as u64;
        let sequence = Sequence::new(Actor::default(), setting);
        let scene = Scene::synthetic(name, &sequence, frames);
        let template = Actor::default().template;
        let model = TrackerModel::new(template, scene.calibration.clone(), configuration(settings));
        let (mut state, mut workspace) = (TrackerState::new(&model), Workspace::default());
        let (mut skins, mut off): (Vec<Vec<tryon::math::P3>>, Vec<f64>) = (vec![], vec![]);
        for (i, frame) in scene.frames.iter().enumerate() {
            tryon::tracking::step(&model, &mut state, frame, &mut workspace).expect("step");
            let (vertices, _) = workspace.posed(&model, &state);
            if i >= 60 {
                let truth = &scene.truth[i].vertices;
                off.extend(
                    vertices
                        .iter()
                        .zip(truth)
                        .step_by(10)
                        .map(|(a, b)| f64::from((a - b).norm()) * 1e3),
                );
                skins.push(vertices.to_vec());
            }
        }
        let truth: Vec<_> = scene.truth[60..]
            .iter()
            .map(|t| t.joints.iter().map(|p| p.cast::<f32>()).collect())
            .collect();
        let moved = |skins: &[Vec<tryon::math::P3>], lag: usize| {
            let pairs = skins.windows(lag + 1);
            let mut all: Vec<f64> = pairs
                .flat_map(|w| {
                    w[0].iter()
                        .zip(&w[lag])
                        .map(|(a, b)| f64::from((a - b).norm()) * 1e3)
                        .collect::<Vec<_>>()
                })
                .collect();
            all.sort_by(f64::total_cmp);
            format!(
                "{:.2} mm (p95 {:.2})",
                mean(&all),
                all[all.len() * 95 / 100]
            )
        };
        println!(
            "{name} {settings}: from picture to picture {}, in a third of a second {}, off {:.2} mm; true joints {} and {}",
            moved(&skins, 1),
            moved(&skins, 10),
            mean(&off),
            moved(&truth, 1),
            moved(&truth, 10)
        );
    }
}

fn stills(a: &Args, template: &Arc<Template>, settings: &str, folder: &Path, label: &str) {
    let config = configuration(settings);
    let scene = a
        .overlay
        .as_ref()
        .map(|_| Scene::open(folder).expect("a scene"));
    let out = tryon::evaluate::stills::stills(
        template,
        &config,
        folder,
        a.still as u64,
        |i, m, state, w, _, share| {
            if a.verbose {
                println!("{i:4} {:?} within {:.2}", state.status, share);
            }
            if let Some(dir) = &a.jsonl {
                std::fs::create_dir_all(dir).expect("jsonl folder");
                std::fs::write(
                    dir.join(format!("still_{i:04}.json")),
                    joints_line(m, state, w, i),
                )
                .expect("json");
            }
            if let (Some(dir), Some(scene)) = (&a.overlay, &scene) {
                std::fs::create_dir_all(dir).expect("overlay folder");
                let image = overlay(template, m, state, w, scene, i);
                write_png_rgb(&dir.join(format!("still_{i:04}.png")), &image).expect("png");
            }
        },
    )
    .expect("stills");
    println!(
        "{} {label} {settings}: {:.1} % of joints within 10 cm, found {} of {}, first step {:.0} ms (median)",
        folder.file_name().unwrap_or_default().to_string_lossy(),
        mean(&out.within) * 100.0,
        out.found,
        out.within.len(),
        median(&out.start_ms),
    );
    let mm = |v: &nalgebra::Vector3<f64>| {
        format!("[{:.0} {:.0} {:.0}]", v.x * 1e3, v.y * 1e3, v.z * 1e3)
    };
    let list: Vec<String> = out
        .per_joint
        .iter()
        .zip(&out.bias)
        .map(|((n, s), b)| format!("{n} {:.0} {}", s * 100.0, mm(b)))
        .collect();
    println!("  {}", list.join(", "));
}

/// What segmentation makes of each picture on its own: red floor, blue background, green person, grey other.
fn labels(dir: &Path, scene: &Scene, every: usize) {
    std::fs::create_dir_all(dir).expect("folder");
    for (i, frame) in scene.frames.iter().enumerate().step_by(every) {
        let mut cloud = OrganisedCloud::new(&scene.calibration.depth, None);
        cloud.sample(&frame.depth, 8.0);
        let planes = find_planes(&cloud);
        let found = find_person(&mut cloud, &planes, None, &mut SegmentScratch::default());
        println!(
            "{} {i}: floor {:?}, {} background, {} cells, {} components, cut below {}",
            scene.name,
            planes.floor.map(|f| f.offset),
            planes.background.len(),
            found.cells.len(),
            found.components,
            found.cut_below
        );
        let (w, h) = cloud.size();
        let mut image = ColorImage::filled(w as u32, h as u32, [0; 3]);
        for (k, label) in cloud.labels.iter().enumerate() {
            let l = (250.0 - 50.0 * cloud.depth[k]).clamp(30.0, 250.0) as u8;
            let rgb = match label {
                Label::Unknown => [0, 0, 0],
                Label::Floor => [l, 0, 0],
                Label::Background => [0, 0, l],
                Label::Other => [l, l, l],
                Label::Person => [0, l, 0],
            };
            image.data_mut()[3 * k..3 * k + 3].copy_from_slice(&rgb);
        }
        write_png_rgb(&dir.join(format!("{}_{i:04}.png", scene.name)), &image).expect("png");
    }
}

fn overlay(
    template: &Template,
    model: &TrackerModel,
    state: &TrackerState,
    workspace: &mut Workspace,
    scene: &Scene,
    i: usize,
) -> ColorImage {
    let camera = scene.calibration.depth;
    let (vertices, _) = workspace.posed(model, state);
    let view = View::Perspective { camera, near: 0.1 };
    let mut buffer = VisibilityBuffer::default();
    rasterise(&view, vertices, template.mesh().faces(), &mut buffer);
    let mut image = ColorImage::filled(camera.width, camera.height, [0, 0, 0]);
    for (k, d) in scene.frames[i].depth.data().iter().enumerate() {
        let z = f32::from(*d) * 1e-3;
        let shade = if z > 0.0 {
            (240.0 - (z - 1.2) * 70.0).clamp(20.0, 240.0) as u8
        } else {
            0
        };
        let mut rgb = [shade; 3];
        if buffer.face[k] != VisibilityBuffer::NONE {
            let f = template.mesh().faces()[buffer.face[k] as usize];
            let l = (-face_normal(vertices, &f).normalize().z).clamp(0.0, 1.0);
            rgb = [
                (f32::from(shade) * 0.5) as u8,
                (l * 160.0) as u8 / 2 + shade / 3,
                (l * 120.0) as u8 + shade / 4,
            ];
        }
        image.data_mut()[3 * k..3 * k + 3].copy_from_slice(&rgb);
    }
    image
}
