//! Cost of a picture with and without hidden faces and the normals of unseen ones.
//!
//! `cargo run --release -p tryon-bench --example unseen -- [--input ../shared/data/rgbd/depthkit_still] [--rounds 60] [--threads 1]
//!   [--out DIR]`
//!
//! The person of a recording is tracked and dressed, then the same picture is drawn with every setting in turn, round
//! after round. "fine" divides each drawn triangle into four. Prints a Markdown row a scene: medians in milliseconds.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used)] // a development tool: stop at the first fault

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use tryon::body::{Pose, Template, embedded};
use tryon::cloth::{self, Config as ClothConfig};
use tryon::dressing::{DressOptions, dress, suggest};
use tryon::formats::image::write_png_rgb;
use tryon::formats::open_recording;
use tryon::garment::library;
use tryon::geometry::camera::{Calibration, ColorImage, RgbdFrame};
use tryon::geometry::math::order_statistics::median;
use tryon::geometry::math::{P3, World};
use tryon::geometry::mesh::Face;
use tryon::geometry::par::{Par, with_threads};
use tryon::mirror::library_appearance;
use tryon::tracking::{self, Status, TrackerConfig, TrackerModel, TrackerState};
use tryon::view::{
    Appearance, BodyView, Config, GarmentView, Input, Limbs, Model, RenderReport, State, Workspace,
    render,
};

/// Rounds before the timed ones.
const WARM_UP: usize = 3;
/// Pictures of a still until the body is tracked and the cloth hangs.
const SETTLE: u64 = 60;
/// Between pictures, nanoseconds.
const INTERVAL_NS: u64 = 33_333_333;
/// Innermost first.
const OUTFITS: [&[&str]; 4] = [
    &["tshirt"],
    &["straight_skirt", "tshirt"],
    &["tank", "hoodie"],
    &["shorts", "dress"],
];
/// Hidden faces and unseen normals left out.
const SWITCHES: [(&str, bool, bool); 4] = [
    ("everything", false, false),
    ("no hidden faces", true, false),
    ("no unseen normals", false, true),
    ("neither", true, true),
];

struct Drawn {
    vertices: Vec<P3>,
    faces: Vec<Face>,
    uv: Vec<[f32; 2]>,
    appearance: Appearance,
}

impl Drawn {
    fn view(&self) -> GarmentView<'_> {
        GarmentView {
            vertices: &self.vertices,
            faces: &self.faces,
            uv: &self.uv,
            normals: &[],
            appearance: &self.appearance,
        }
    }

    /// Each triangle divided into four.
    fn finer(&self) -> Self {
        let (mut vertices, mut uv, mut faces) =
            (self.vertices.clone(), self.uv.clone(), Vec::new());
        let mut middles = BTreeMap::new();
        for f in &self.faces {
            let m = [0, 1, 2].map(|k| {
                let (a, b) = (f[k].min(f[(k + 1) % 3]), f[k].max(f[(k + 1) % 3]));
                *middles.entry((a, b)).or_insert_with(|| {
                    let (a, b) = (a as usize, b as usize);
                    vertices.push(nalgebra::center(&vertices[a], &vertices[b]));
                    uv.push([0, 1].map(|c| 0.5 * (uv[a][c] + uv[b][c])));
                    vertices.len() as u32 - 1
                })
            });
            faces.extend([
                [f[0], m[0], m[2]],
                [m[0], f[1], m[1]],
                [m[2], m[1], f[2]],
                m,
            ]);
        }
        Self {
            vertices,
            faces,
            uv,
            appearance: self.appearance.clone(),
        }
    }
}

struct Args {
    input: PathBuf,
    rounds: usize,
    threads: usize,
    out: Option<PathBuf>,
}

fn args() -> Args {
    let mut a = Args {
        input: PathBuf::from("../shared/data/rgbd/depthkit_still"),
        rounds: 60,
        threads: 1,
        out: None,
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let value = words.next().unwrap();
        match word.as_str() {
            "--input" => a.input = value.into(),
            "--rounds" => a.rounds = value.parse().unwrap(),
            "--threads" => a.threads = value.parse().unwrap(),
            "--out" => a.out = Some(value.into()),
            other => panic!("{other} is not understood"),
        }
    }
    a
}

/// The person of a recording, tracked.
struct Tracked {
    calibration: Calibration,
    frame: RgbdFrame,
    template: Arc<Template>,
    state: TrackerState,
    /// Posed body in the camera's frame, metres.
    body_camera: Vec<P3>,
}

fn track(path: &Path) -> Tracked {
    let mut source = open_recording(path).unwrap();
    let calibration = source.calibration().clone();
    let frame = source.next_frame().unwrap().unwrap();
    let template = embedded::template();
    let config = TrackerConfig::default();
    let tracker = TrackerModel::new(template.clone(), calibration.clone(), config);
    let (mut state, mut work) = (TrackerState::new(&tracker), tracking::Workspace::default());
    for k in 0..SETTLE {
        let frame = RgbdFrame {
            time_ns: frame.time_ns + k * INTERVAL_NS,
            sequence: frame.sequence + k,
            ..frame.clone()
        };
        tracking::step(&tracker, &mut state, &frame, &mut work).unwrap();
    }
    assert_eq!(state.status, Status::Tracking);
    Tracked {
        body_camera: work.posed(&tracker, &state).0.to_vec(),
        calibration,
        frame,
        template,
        state,
    }
}

/// Dresses the person and lets the cloth settle; garments in the camera's frame.
fn dressed(t: &Tracked, names: &[&str]) -> Vec<Drawn> {
    let rest = t.template.personalise(&t.state.shape);
    let measures = tryon::body::measure::measure(&t.template, &rest).unwrap();
    let size = |n: &str| suggest(n, &measures).map_or(Default::default(), |s| s.size);
    let patterns: Vec<_> = names
        .iter()
        .map(|n| library::pattern(n, size(n)).unwrap())
        .collect();
    let pose: Pose<World> = Pose {
        root: t.state.world_from_camera * t.state.pose.root,
        angles: t.state.pose.angles.clone(),
    };
    let options = DressOptions {
        config: ClothConfig::tracked(),
        any_size: true,
        ..DressOptions::default()
    };
    let mut dressed = dress(&t.template, &rest, &pose, &patterns, &options).unwrap();
    let mut body = Vec::new();
    (t.state.world_from_camera).points_f32(&t.body_camera, &mut body);
    let mut work = cloth::Workspace::default();
    for _ in 0..SETTLE {
        let input = cloth::Input {
            body: &body,
            dt: 1.0 / 30.0,
        };
        cloth::step(&dressed.model, &mut dressed.state, &input, &mut work).unwrap();
    }
    let camera_from_world = t.state.world_from_camera.inverse();
    let meshes = dressed.model.outfit.garments.iter();
    meshes
        .zip(&dressed.state.garments)
        .map(|(mesh, state)| {
            let (mut world, mut vertices) = (Vec::new(), Vec::new());
            mesh.render_positions(&state.positions, &mut world);
            camera_from_world.points_f32(&world, &mut vertices);
            Drawn {
                vertices,
                faces: mesh.render.faces.clone(),
                uv: mesh.render.uv.clone(),
                appearance: library_appearance(&mesh.name),
            }
        })
        .collect()
}

fn main() {
    let a = args();
    let tracked = track(&a.input);
    print!("| worn | vertices |");
    SWITCHES.iter().for_each(|s| print!(" {} |", s.0));
    println!(
        " drawing, normals (everything → neither) | faces hidden | no normals | garments hidden |"
    );
    println!("|---|---|{}---|---|---|---|", "---|".repeat(SWITCHES.len()));
    for names in OUTFITS {
        let coarse = dressed(&tracked, names);
        let fine: Vec<Drawn> = coarse.iter().map(Drawn::finer).collect();
        for (detail, drawn) in [("", &coarse), (", fine", &fine)] {
            let measured = measure(&a, &tracked, drawn);
            measured.print(&format!("{}{detail}", names.join(" under ")), drawn);
            if let Some(dir) = &a.out {
                std::fs::create_dir_all(dir).unwrap();
                let path = dir.join(format!("{}{detail}.png", names.join("_")));
                write_png_rgb(&path, &measured.image).unwrap();
            }
        }
    }
}

/// Times of one scene.
struct Measured {
    /// Medians in milliseconds by setting: all, garments, normals.
    medians: [[f64; 3]; 4],
    image: ColorImage,
    /// Report with everything skipped.
    report: RenderReport,
}

/// Renders the same picture with every setting in turn.
fn measure(a: &Args, t: &Tracked, drawn: &[Drawn]) -> Measured {
    let garments: Vec<GarmentView<'_>> = drawn.iter().map(Drawn::view).collect();
    let input = Input {
        frame: &t.frame,
        calibration: &t.calibration,
        garments: &garments,
        body: Some(BodyView {
            vertices: &t.body_camera,
            faces: t.template.mesh().faces(),
            limbs: &Limbs::of(&t.template),
        }),
        output: None,
    };
    let par = if a.threads == 1 { Par::Seq } else { Par::Rayon };
    let models = SWITCHES.map(|(_, skip_hidden, skip_unseen)| {
        Model::new(Config {
            par,
            skip_hidden,
            skip_unseen,
            ..Config::default()
        })
    });
    let mut works = SWITCHES.map(|_| (State::default(), Workspace::default()));
    let mut times: [[Vec<f64>; 3]; 4] = Default::default();
    let mut last = Vec::new();
    with_threads(a.threads, || {
        for round in 0..a.rounds + WARM_UP {
            last.clear();
            for (k, (state, work)) in works.iter_mut().enumerate() {
                let begun = Instant::now();
                let (image, report) = render(&models[k], state, &input, work).unwrap();
                let all = begun.elapsed().as_secs_f64() * 1e3;
                let stage = |name| {
                    let mut stages = report.stages_ms.iter();
                    stages.find(|s| s.0 == name).map_or(0.0, |s| f64::from(s.1))
                };
                if round >= WARM_UP {
                    let ms = [all, stage("garments"), stage("normals")];
                    times[k].iter_mut().zip(ms).for_each(|(l, ms)| l.push(ms));
                }
                last.push((image, report));
            }
        }
    })
    .unwrap();
    let is_same = last.iter().all(|(image, _)| *image == last[0].0);
    assert!(is_same, "pictures differ");
    let (image, report) = last.pop().unwrap();
    Measured {
        medians: times.map(|lists| lists.map(|mut ms| median(&mut ms).unwrap_or(0.0))),
        image,
        report,
    }
}

impl Measured {
    fn print(&self, name: &str, drawn: &[Drawn]) {
        let vertices: usize = drawn.iter().map(|d| d.vertices.len()).sum();
        let faces: usize = drawn.iter().map(|d| d.faces.len()).sum();
        print!("| {name} | {vertices} |");
        self.medians.iter().for_each(|m| print!(" {:.2} |", m[0]));
        let ([_, drawing, normals], [_, drawing_less, normals_less]) =
            (self.medians[0], self.medians[3]);
        let r = &self.report;
        println!(
            " {drawing:.2}, {normals:.2} → {drawing_less:.2}, {normals_less:.2} | {} of {faces} | {} | {} |",
            r.faces_hidden, r.normals_skipped, r.garments_hidden
        );
    }
}
