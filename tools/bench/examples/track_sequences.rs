//! Tracks recorded and synthetic scenes and prints the measures of `tryon-bench tracking` for chosen settings.
//!
//! `cargo run --release -p tryon-bench --example track_sequences -- [--body FILE]… [--set JSON]… [--own] [--synth] [--hard] [--upper]
//! [--frames N] [--nth N] [--still N] [--stages] FOLDER…`
//!
//! Every body and setting runs on every scene. `--own` gives a scene its subject's own body, `--synth`, `--hard` and
//! `--upper` add synthetic scenes (`--upper`: without feet in view).
#![allow(clippy::print_stdout, clippy::expect_used)] // a development tool: stop at the first fault

use std::path::{Path, PathBuf};
use std::sync::Arc;
use tryon::body::{Template, import::template_from_smpl};
use tryon::formats::npz::read_smpl;
use tryon::formats::read_motion;
use tryon::geometry::camera::{NoiseModel, RgbdFrame};
use tryon::synth::{Actor, Sequence, Setting};
use tryon::tracking::TrackerConfig;
use tryon_bench::stills::stills;
use tryon_bench::tracking::{TrackOutcome, follow, mean, median};
use tryon_bench::{DepthScene, scenes};

struct Args {
    data: PathBuf,
    bodies: Vec<PathBuf>,
    settings: Vec<String>,
    folders: Vec<PathBuf>,
    switches: Vec<String>,
    frames: usize,
    nth: usize,
    still: u64,
}

impl Args {
    fn parse() -> Self {
        let shared = std::env::var("TRYON_SHARED").unwrap_or_else(|_| "../shared".into());
        let mut a = Self {
            data: PathBuf::from(shared).join("data"),
            bodies: vec![],
            settings: vec![],
            folders: vec![],
            switches: vec![],
            frames: usize::MAX,
            nth: 1,
            still: 10,
        };
        let mut args = std::env::args().skip(1);
        while let Some(word) = args.next() {
            let mut value = || args.next().expect("a value");
            match word.as_str() {
                "--body" => a.bodies.push(value().into()),
                "--set" => a.settings.push(value()),
                "--frames" => a.frames = value().parse().expect("a number"),
                "--nth" => a.nth = value().parse().expect("a number"),
                "--still" => a.still = value().parse().expect("a number"),
                switch if switch.starts_with('-') => a.switches.push(word),
                _ => a.folders.push(word.into()),
            }
        }
        if a.bodies.is_empty() {
            let template = "body/makehuman_smpl_layout/template.npz";
            a.bodies.push(a.data.join(template));
        }
        if a.settings.is_empty() {
            a.settings.push("{}".into());
        }
        a
    }

    fn has(&self, switch: &str) -> bool {
        self.switches.iter().any(|s| s == switch)
    }
}

fn main() {
    let a = Args::parse();
    let bodies: Vec<Arc<Template>> = a.bodies.iter().map(|b| body(b)).collect();
    for folder in &a.folders {
        if folder.join("joints.json").exists() {
            for (template, settings) in combinations(&a, &bodies) {
                print_stills(template, settings, folder, a.still);
            }
        } else {
            let scene = DepthScene::open(folder).expect("a scene");
            run(&a, &bodies, repeated(scene, a.still), None);
        }
    }
    if a.has("--synth") {
        for name in scenes::unseen_names() {
            run(
                &a,
                &bodies,
                scenes::unseen(&a.data, name).expect("a scene"),
                None,
            );
        }
    }
    if a.has("--upper") {
        for spec in &UPPER {
            run(&a, &bodies, without_feet(&a.data, spec), Some(spec.body));
        }
    }
    if a.has("--hard") {
        let hard = scenes::hard(&a.data).expect("scenes");
        for scene in hard
            .into_iter()
            .chain(scenes::idle(&a.data).expect("scenes"))
        {
            run(&a, &bodies, scene, None);
        }
    }
}

fn combinations<'a>(
    a: &'a Args,
    bodies: &'a [Arc<Template>],
) -> impl Iterator<Item = (&'a Arc<Template>, &'a String)> {
    let settings = a.settings.iter();
    bodies
        .iter()
        .flat_map(move |b| settings.clone().map(move |s| (b, s)))
}

/// Bodies that scenes were made with.
const SUBJECTS: [&str; 4] = [
    "subject_f_avg",
    "subject_f_short_heavy",
    "subject_m_heavy",
    "subject_m_tall",
];

/// Clip whose picture shows no feet: its lower rim is 0.456 × distance below the camera's height.
struct UpperClip {
    name: &'static str,
    body: &'static str,
    clip: &'static str,
    noise: NoiseModel,
    /// Height and distance of the camera, metres.
    camera: [f64; 2],
    /// Frames until the subject walks out of the picture.
    frames: u64,
}

const fn upper(
    [name, body, clip]: [&'static str; 3],
    noise: NoiseModel,
    camera: [f64; 2],
    frames: u64,
) -> UpperClip {
    UpperClip {
        name,
        body,
        clip,
        noise,
        camera,
        frames,
    }
}

#[rustfmt::skip]
const UPPER: [UpperClip; 5] = [
    upper(["shins_13_31_f_avg", "subject_f_avg", "cmu_asf_amc/13_31.amc"], NoiseModel::KinectV1, [1.45, 2.6], 150),
    upper(["knees_93_04_m_heavy", "subject_m_heavy", "cmu_asf_amc/93_04.amc"], NoiseModel::TimeOfFlight, [1.5, 2.2], 150),
    upper(["thighs_02_07_f_short", "subject_f_short_heavy", "cmu_asf_amc/02_07.amc"], NoiseModel::KinectV1, [1.45, 1.9], 150),
    upper(["knees_walk_m_tall", "subject_m_tall", "cmu_bvh/02_03.bvh"], NoiseModel::TimeOfFlight, [1.5, 2.3], 75),
    upper(["knees_02_02_f_avg", "subject_f_avg", "cmu_bvh/02_02_makehuman.bvh"], NoiseModel::TimeOfFlight, [1.4, 2.2], 90),
];

fn without_feet(data: &Path, spec: &UpperClip) -> DepthScene {
    let subject = Actor {
        template: scenes::subject(data, spec.body).expect("a body"),
        ..Actor::default()
    };
    let [height, distance] = spec.camera;
    let setting = Setting {
        world_from_camera: Setting::tilted(height, 0.0, 0.0),
        home: nalgebra::Point3::new(0.0, 0.0, -distance),
        room: None,
        noise: spec.noise,
        color: false,
        seed: 13,
        ..Setting::default()
    };
    let motion = read_motion(&data.join("motion").join(spec.clip)).expect("a clip");
    let sequence = Sequence::new(subject, setting)
        .with_clip(motion.at_cmu_rate())
        .expect("a clip of a person");
    DepthScene::synthetic(spec.name, &sequence, spec.frames)
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

/// A scene of one frame shown `times` times.
fn repeated(mut scene: DepthScene, times: u64) -> DepthScene {
    if let [one] = scene.frames.as_slice() {
        let frame = |i: u64| RgbdFrame {
            sequence: i,
            time_ns: i * 33_333_333,
            ..one.clone()
        };
        scene.frames = (0..times).map(frame).collect();
    }
    scene
}

fn run(a: &Args, bodies: &[Arc<Template>], mut scene: DepthScene, subject: Option<&str>) {
    scene.frames.truncate(a.frames);
    if a.nth > 1 {
        scene = scene.every(a.nth);
    }
    let known = |s: &&str| scene.name.contains(s.trim_start_matches("subject_"));
    let subject = subject.or_else(|| SUBJECTS.into_iter().find(known));
    let own = subject
        .filter(|_| a.has("--own"))
        .map(|name| scenes::subject(&a.data, name).expect("a body"));
    for (template, settings) in combinations(a, bodies) {
        let template = own.as_ref().unwrap_or(template);
        let config = configuration(settings);
        let out = follow(template, &config, &scene, |_, _, _, _, _| {});
        print_outcome(&scene, settings, &out, a.has("--stages"));
    }
}

fn print_outcome(scene: &DepthScene, settings: &str, out: &TrackOutcome, stages: bool) {
    let size: f64 = out.stages.iter().map(|s| s.size).fold(0.0, f64::max);
    println!(
        "{} {settings}: joints {:.1} mm (worst frame {:.1}), visible {:.1}, whole {:.1}, vertices {:.1} mm, bones {:.1} %, lost {}, found {:?}, step {:.2} ms, pose+skin {:.2}, size {size:.0}, residual {:.2}",
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
    if stages {
        println!(
            "  stages: segment {:.2}, pose {:.2}, size {:.2}, surface {:.2}, skin {:.2}; first frame place {:.1}, size {size:.1}; {:.1} iterations",
            out.stage_ms(|s| s.segment),
            out.stage_ms(|s| s.pose),
            out.stage_ms(|s| s.size),
            out.stage_ms(|s| s.surface),
            out.posing_ms(),
            out.stages.iter().map(|s| s.place).fold(0.0, f64::max),
            mean(&out.iterations),
        );
    }
}

fn print_stills(template: &Arc<Template>, settings: &str, folder: &Path, times: u64) {
    let config = configuration(settings);
    let out = stills(template, &config, folder, times, |_, _, _, _, _, _| {}).expect("stills");
    println!(
        "{} {settings}: {:.1} % of joints within 10 cm, found {} of {}, first step {:.0} ms (median)",
        folder.display(),
        mean(&out.within) * 100.0,
        out.found,
        out.within.len(),
        median(&out.start_ms),
    );
    for (name, share) in &out.per_joint {
        println!("  {name} {:.0} %", share * 100.0);
    }
}
